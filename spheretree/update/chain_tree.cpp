#include "spheretree/update/chain_tree.hpp"

#include "spheretree/bounding.hpp"
#include "spheretree/hierarchy.hpp"

#include <algorithm>
#include <cassert>

namespace trocar::spheretree {

ChainTree make_chain_tree(std::size_t capacity, unsigned branching) { return {split_in_order(capacity, branching)}; }

void update_chain(const ChainTree& chain, std::span<const Sphere> links_t0, std::span<const Sphere> links_t1, ChainState& state) {
    const SphereTree& tree = chain.tree;
    assert(links_t0.size() == links_t1.size() && links_t0.size() <= chain.capacity());
    state.links_t0.assign(links_t0.begin(), links_t0.end());
    state.links_t1.assign(links_t1.begin(), links_t1.end());
    state.hint.resize(chain.capacity(), kNoIndex);
    state.spheres.resize(tree.sphere_count());
    for (Index s = static_cast<Index>(tree.sphere_count()); s-- > 0;) {
        if (tree.is_leaf(s)) {
            const Index link = chain.link_of_leaf(s);
            state.spheres[s] = link < links_t0.size() ? enclose_two(links_t0[link], links_t1[link]) : Sphere{};
        } else {
            const auto children = std::span<const Sphere>(state.spheres).subspan(tree.first_child[s], tree.child_count[s]);
            state.spheres[s] = enclose(children, 1);
        }
    }
}

} // namespace trocar::spheretree
