// One place of contact, alone: what its impulse does to the nodes of both sides, whichever of them both stand on.
#include "engine/step/contact/contact_solver.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>

namespace trocar::engine {
namespace {

/// Two places of one body at 1 m/s or so, each in a tetrahedron of its own, of which `shared` nodes are the same.
class OnePlace {
public:
    OnePlace(std::mt19937_64& rng, std::size_t shared) {
        std::uniform_real_distribution<double> place(-0.01, 0.01), speed(-1.0, 1.0), share(0.05, 1.0), mass(0.5e-3, 2e-3);
        for (std::size_t n = 0; n < nodes_.size(); ++n) {
            for (int axis = 0; axis < 3; ++axis) nodes_[n].x[axis] = place(rng), nodes_[n].v[axis] = speed(rng);
            inv_mass_[n] = 1.0 / mass(rng);
        }
        const auto stand_on = [&](ContactSide& side, std::array<Index, 4> on) {
            side.slot = 0;
            side.feet = 1;
            side.share[0] = 1.0;
            std::copy(on.begin(), on.end(), side.record[0]);
            for (double& weight : side.weight[0]) weight = share(rng);
            const double sum = std::accumulate(side.weight[0], side.weight[0] + 4, 0.0);
            for (double& weight : side.weight[0]) weight /= sum;
            side.start = side.image([&](Index n) { return Vec3(nodes_[n].x[0], nodes_[n].x[1], nodes_[n].x[2]); });
        };
        const auto first = static_cast<Index>(4 - shared);
        stand_on(row_.a, {0, 1, 2, 3});
        stand_on(row_.b, {first, first + 1, first + 2, first + 3});
        row_.normal = Vec3(speed(rng), speed(rng), speed(rng)).normalized();
        row_.gap = -1e-3;
        row_.recovery = 0.1;
        bodies_[0] = {nodes_, inv_mass_.data()};
        solver_.begin(std::span(&row_, 1), bodies_);
    }

    [[nodiscard]] Vec3 velocity(std::size_t node) const { return Vec3(nodes_[node].v[0], nodes_[node].v[1], nodes_[node].v[2]); }
    [[nodiscard]] Vec3 momentum() const {
        Vec3 sum = Vec3::Zero();
        for (std::size_t n = 0; n < nodes_.size(); ++n) sum += velocity(n) / inv_mass_[n];
        return sum;
    }
    void solve() {
        solver_.observe();
        (void)solver_.approach(0.0, 1e-3, 1.0, 1.0);
    }
    static constexpr std::size_t kNodes = 8;

private:
    std::array<fem::NodeRecord, kNodes> nodes_{};
    std::array<double, kNodes> inv_mass_{};
    std::array<GivingBody, 1> bodies_;
    ContactRow row_;
    ContactSolver solver_;
};

/// An impulse over a mobility that is only rounding would throw the nodes: of a body that touches itself both sides may be carried by the
/// same ones.
TEST(ContactSolver, ThrowsNoNodeWhicheverOfThemBothSidesStandOn) {
    std::mt19937_64 rng(26);
    std::size_t parted = 0, torn = 0;
    for (std::size_t shared = 0; shared <= 4; ++shared)
        for (int round = 0; round < 500; ++round) {
            SCOPED_TRACE(fmt::format("seed 26: {} nodes shared, round {}", shared, round));
            OnePlace place(rng, shared);
            std::array<Vec3, OnePlace::kNodes> before;
            for (std::size_t n = 0; n < before.size(); ++n) before[n] = place.velocity(n);
            const Vec3 momentum = place.momentum();
            place.solve();
            double most = 0.0;
            for (std::size_t n = 0; n < before.size(); ++n) most = std::max(most, (place.velocity(n) - before[n]).norm());
            EXPECT_LT(most, 60.0) << "m/s, where both sides move at sqrt(3) at most";
            EXPECT_LT((place.momentum() - momentum).norm(), 1e-12) << "N s";
            (shared < 4 ? parted : torn) += most > 0.0;
        }
    EXPECT_GT(parted, 500u) << "places that do not share all of their nodes are parted";
    EXPECT_LT(torn, 10u) << "of 500 that do, the few whose tetrahedron is too flat to move one side to the other's place";
}

} // namespace
} // namespace trocar::engine
