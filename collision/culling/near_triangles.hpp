// Stage I: pairs of triangles whose swept boxes come near, found by two box trees, or one against itself.
#pragma once

#include "collision/bvh/box_tree.hpp"

#include <vector>

namespace trocar::collision {

/// Two triangles by id; of one surface with itself the lower one first.
struct TrianglePair {
    Index a, b;
    friend bool operator==(const TrianglePair&, const TrianglePair&) = default;
};

class NearTriangles {
public:
    /// Pairs of different triangles of one surface; adjacent ones go to a list of their own, if one is given, or nowhere.
    /// distance   m, rounded up
    /// pairs      appended in an order that depends on the tree alone
    void find_self(BoxTree& tree, float distance, std::vector<TrianglePair>& pairs, std::vector<TrianglePair>* adjacent = nullptr);
    void find(BoxTree& a, BoxTree& b, float distance, std::vector<TrianglePair>& pairs);

    [[nodiscard]] std::uint64_t box_tests() const noexcept { return box_tests_; } // of the last call: nodes and triangles

private:
    template <class Visit>
    void traverse(BoxTree& a, BoxTree& b, bool self, float distance, Visit&& visit);

    std::vector<TrianglePair> stack_; // of nodes
    std::uint64_t box_tests_ = 0;
};

} // namespace trocar::collision
