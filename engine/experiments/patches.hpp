// Contacts as places on surfaces, so that the answers of two budgets can be compared: a surface at rest is cut into cells
// (patches), and an answer is the list of patches that are in contact, each with its depth.
#pragma once

#include "base/inside.hpp"
#include "engine/scene/scene.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"

#include <compare>
#include <vector>

namespace trocar::engine {

struct PatchId {
    Thing body;  // whose surface
    Thing other; // what touches it
    std::array<std::uint16_t, 3> cell{};
    friend auto operator<=>(const PatchId&, const PatchId&) = default;
};

struct PatchContact {
    PatchId patch;
    double depth = 0.0; // m, deepest within the patch. Solids: tolerance minus gap, so that it begins with 0 where contact
                        // begins. Instruments: the part of the clearance that is missing.
};

/// Sorted by patch, each once.
using PatchContacts = std::vector<PatchContact>;

/// Cuts the surfaces of a scene into patches and finds which surfaces touch. Reads simulators, never changes them.
class PatchFinder {
public:
    PatchFinder(const SceneModel& model, const CostSpec& cost);

    /// Solid surfaces that are nearer than the tolerance, or inside one another: vertex against surface, both ways. Shares
    /// nothing with the contact stages.
    [[nodiscard]] PatchContacts find_near(const State& state);

    /// The answer of the simulator's last step. Solids: all that lies beneath a pair of spheres that it took as a contact, as
    /// deep as the response takes it; pairs that the budget left open among them. Instruments: where the response presses.
    [[nodiscard]] PatchContacts find_answer(const Simulator& simulator);

    [[nodiscard]] double tolerance() const noexcept { return tolerance_; }
    [[nodiscard]] double patch_size(std::size_t body) const noexcept { return grids_[body].size; }

private:
    struct Grid {
        Vec3 origin = Vec3::Zero(); // m
        double size = 1.0;          // m
        std::vector<std::array<std::uint16_t, 3>> cell_of_triangle;
        std::vector<std::vector<std::array<std::uint16_t, 3>>> cells_of_sphere; // filled when asked for
    };
    [[nodiscard]] std::array<std::uint16_t, 3> cell_of(std::size_t body, const Vec3& rest_point) const noexcept;
    [[nodiscard]] const std::vector<std::array<std::uint16_t, 3>>& cells_of_sphere(std::size_t body, Index sphere);
    void find_near_one_way(std::size_t body, std::size_t other, const State& state, PatchContacts& found) const;
    void add_side(const Contact& contact, bool is_a, PatchContacts& found);

    const SceneModel& model_;
    double tolerance_;
    std::vector<Grid> grids_;        // [body]
    std::vector<InsideTest> inside_; // [body] solid ones that something can touch
};

/// Missed and false patches of an answer, against a reference of the same step.
struct PatchDifference {
    std::uint64_t reference = 0, missed = 0, spurious = 0;
    std::uint64_t unseen = 0; // of those missed, between solids that are near there in the answer's own state as well (count_unseen)
    double depth_error_sq = 0.0; // m^2, sum over the patches of either list
    std::uint64_t compared = 0;  // how many those are
    PatchDifference& operator+=(const PatchDifference& other) noexcept;
};
/// All but `unseen`.
[[nodiscard]] PatchDifference compare_patches(const PatchContacts& reference, const PatchContacts& answer) noexcept;

/// Patches of the reference, between solids, that are near and that the answer lacks. A budget may end the solver early, and then
/// surfaces that touch in the exact answer can be apart in this one: these are missed, but nothing was overlooked.
/// near     of the answer's own state (PatchFinder::find_near)
[[nodiscard]] std::uint64_t count_unseen(const PatchContacts& reference, const PatchContacts& answer, const PatchContacts& near) noexcept;

/// nullptr where it is in no contact.
[[nodiscard]] const PatchContact* find_patch(const PatchContacts& contacts, const PatchId& patch) noexcept;

} // namespace trocar::engine
