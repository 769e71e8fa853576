// Orientation, and what lies inside what.
#include "base/inside.hpp"
#include "base/repair_steps.hpp"
#include "base/topology.hpp"

#include <algorithm>

namespace trocar::repairs {
namespace {

constexpr std::size_t kNestingSamples = 64; // vertices of a shell that must all lie inside another one

struct EdgeLink {
    Index triangle = kNoIndex;
    bool turned = false; // both run through the edge the same way
};

std::vector<std::array<EdgeLink, 3>> link_triangles(const TriMesh& mesh) {
    std::vector<std::array<EdgeLink, 3>> links(mesh.triangles.size());
    for_each_edge(sorted_edge_uses(mesh.triangles), [&](std::span<const EdgeUse> edge) {
        if (edge.size() != 2) return;
        const bool turned = edge[0].forward == edge[1].forward;
        links[edge[0].triangle][edge[0].corner] = {edge[1].triangle, turned};
        links[edge[1].triangle][edge[1].corner] = {edge[0].triangle, turned};
    });
    return links;
}

void flip(Triangle& t) noexcept { std::swap(t[1], t[2]); }

bool contains(const Box3& outer, const Box3& inner) noexcept { return outer.contains(inner.lo) && outer.contains(inner.hi); }

bool is_closed(const TriMesh& mesh) { return inspect_surface(mesh).closed(); }

/// A shell with what nesting needs to know.
struct Shell {
    Part part;
    Box3 box;
    double volume = 0.0;
    bool closed = false;
};

std::vector<Shell> find_shells(const TriMesh& mesh) {
    std::vector<Shell> shells;
    for (Part& part : split_into_shells(mesh)) {
        Shell shell{std::move(part), {}, 0.0, false};
        shell.box = shell.part.mesh.bounds();
        shell.volume = signed_volume(shell.part.mesh);
        shell.closed = is_closed(shell.part.mesh);
        shells.push_back(std::move(shell));
    }
    return shells;
}

bool lies_inside(const Shell& inner, const InsideTest& outer) {
    const auto& vertices = inner.part.mesh.vertices;
    const std::size_t stride = std::max<std::size_t>(1, vertices.size() / kNestingSamples);
    for (std::size_t v = 0; v < vertices.size(); v += stride)
        if (!outer.inside(vertices[v])) return false;
    return true;
}

/// [shell] the smallest closed shell that holds it altogether, kNoIndex where there is none.
std::vector<Index> find_containers(const std::vector<Shell>& shells) {
    std::vector<Index> container(shells.size(), kNoIndex);
    for (Index outer = 0; outer < shells.size(); ++outer) {
        if (!shells[outer].closed) continue;
        std::optional<InsideTest> test; // built only where boxes nest
        for (Index inner = 0; inner < shells.size(); ++inner) {
            if (inner == outer || !contains(shells[outer].box, shells[inner].box)) continue;
            if (std::abs(shells[inner].volume) >= std::abs(shells[outer].volume)) continue;
            const Index known = container[inner];
            if (known != kNoIndex && std::abs(shells[known].volume) <= std::abs(shells[outer].volume)) continue;
            if (!test) test.emplace(shells[outer].part.mesh);
            if (lies_inside(shells[inner], *test)) container[inner] = outer;
        }
    }
    return container;
}

} // namespace

std::vector<Part> split_into_shells(const TriMesh& mesh) {
    const Components components = find_components(mesh.triangles, mesh.vertices.size(), Joined::BySharedEdges);
    std::vector<Part> parts(components.count);
    for (Index t = 0; t < mesh.triangles.size(); ++t) parts[components.of_triangle[t]].triangle_ids.push_back(t);
    std::vector<Index> local(mesh.vertices.size(), kNoIndex), mine;
    for (Part& part : parts) {
        mine.clear();
        for (const Index t : part.triangle_ids) {
            Triangle corners = mesh.triangles[t];
            for (Index& v : corners) {
                if (local[v] == kNoIndex) {
                    local[v] = static_cast<Index>(mine.size());
                    mine.push_back(v);
                    part.mesh.vertices.push_back(mesh.vertices[v]);
                }
                v = local[v];
            }
            part.mesh.triangles.push_back(corners);
        }
        for (const Index v : mine) local[v] = kNoIndex;
    }
    return parts;
}

Result<std::size_t> orient_consistently(TriMesh& mesh) {
    const auto links = link_triangles(mesh);
    enum class Turn : std::uint8_t { Unknown, Keep, Flip };
    std::vector<Turn> turn(mesh.triangles.size(), Turn::Unknown);
    std::size_t flipped = 0;
    std::vector<Index> shell;
    for (Index seed = 0; seed < turn.size(); ++seed) {
        if (turn[seed] != Turn::Unknown) continue;
        shell.assign(1, seed);
        turn[seed] = Turn::Keep;
        for (std::size_t next = 0; next < shell.size(); ++next) {
            const Index t = shell[next];
            for (const EdgeLink& link : links[t]) {
                if (link.triangle == kNoIndex) continue;
                const Turn wanted = (turn[t] == Turn::Flip) != link.turned ? Turn::Flip : Turn::Keep;
                Turn& other = turn[link.triangle];
                if (other == Turn::Unknown) {
                    other = wanted;
                    shell.push_back(link.triangle);
                } else if (other != wanted) {
                    return Error{ErrorCode::BadMesh, "the surface has one side only (like a Moebius strip) round triangle " +
                                                         std::to_string(t) + ": it cannot be oriented"};
                }
            }
        }
        const auto turned =
            static_cast<std::size_t>(std::count_if(shell.begin(), shell.end(), [&turn](Index t) { return turn[t] == Turn::Flip; }));
        const Turn minority = 2 * turned > shell.size() ? Turn::Keep : Turn::Flip; // the majority stays as it was
        for (const Index t : shell)
            if (turn[t] == minority) flip(mesh.triangles[t]), ++flipped;
    }
    return flipped;
}

/// Outermost shells outward. A shell inside another keeps what it was to its container: with it, or against it (a cavity).
/// An open shell goes by the sign of the volume that it makes with the centre of its box.
Result<RepairStep> orient(TriMesh& mesh) {
    if (const Result<void> check = check_edge_manifold(mesh, Repair::Orient); !check) return check.error();
    const std::vector<Triangle> before = mesh.triangles;
    if (const Result<std::size_t> consistent = orient_consistently(mesh); !consistent) return consistent.error();
    const std::vector<Shell> shells = find_shells(mesh);
    const std::vector<Index> container = find_containers(shells);
    for (Index s = 0; s < shells.size(); ++s) {
        Index outermost = s;
        while (container[outermost] != kNoIndex) outermost = container[outermost];
        if (shells[outermost].volume >= 0.0) continue; // all that it holds turns with it
        for (const Index t : shells[s].part.triangle_ids) flip(mesh.triangles[t]);
    }
    RepairStep step;
    for (std::size_t t = 0; t < before.size(); ++t) step.triangles_flipped += before[t] != mesh.triangles[t];
    return step;
}

Result<RepairStep> drop_inner_shells(TriMesh& mesh) {
    if (const Result<void> check = check_edge_manifold(mesh, Repair::DropInnerShells); !check) return check.error();
    RepairStep step;
    const std::vector<Shell> shells = find_shells(mesh);
    const std::vector<Index> container = find_containers(shells);
    std::vector<bool> keep(mesh.triangles.size(), true);
    bool cut = false;
    for (Index s = 0; s < shells.size(); ++s) {
        const auto& ids = shells[s].part.triangle_ids;
        if (container[s] != kNoIndex) {
            ++step.shells_removed;
            for (const Index t : ids) keep[t] = false;
        } else if (shells[s].closed) {
            const std::vector<bool> inner = find_inner_skin(shells[s].part.mesh);
            if (std::find(inner.begin(), inner.end(), true) == inner.end()) continue;
            ++step.shells_removed;
            cut = true;
            for (std::size_t t = 0; t < ids.size(); ++t) keep[ids[t]] = !inner[t];
        }
    }
    step.triangles_removed = keep_triangles(mesh, keep);
    if (!cut) return step;
    const Result<RepairStep> closed = fill_holes(mesh); // where the outer skin went over into the inner one
    if (!closed) return closed.error();
    step.holes_filled = closed->holes_filled;
    step.triangles_added = closed->triangles_added;
    return step;
}

} // namespace trocar::repairs
