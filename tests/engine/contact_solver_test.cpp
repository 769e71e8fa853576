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

/// Clouds of masses, some of them fixed, each two held as wholes.
class Wholes {
public:
    Wholes(std::mt19937_64& rng, std::size_t count, bool last_is_fixed) : count_(count) {
        std::uniform_real_distribution<double> place(-0.02, 0.02), speed(-1.0, 1.0), mass(0.1e-3, 3e-3);
        for (std::size_t b = 0; b < count; ++b) {
            const Vec3 at(5.0 * place(rng), 5.0 * place(rng), 5.0 * place(rng)), along(speed(rng), speed(rng), speed(rng));
            for (std::size_t n = 0; n < kNodes; ++n) {
                for (int axis = 0; axis < 3; ++axis)
                    nodes_[b][n].x[axis] = at[axis] + place(rng), nodes_[b][n].v[axis] = along[axis] + 0.3 * speed(rng);
                inv_mass_[b][n] = 1.0 / mass(rng);
            }
            bodies_.push_back({nodes_[b], inv_mass_[b].data()});
        }
        for (std::size_t a = 0; a + 1 < count; ++a)
            for (std::size_t b = a + 1; b < count; ++b) {
                ContactRow row;
                row.room = 0.01;
                row.normal = Vec3(speed(rng), speed(rng), speed(rng)).normalized();
                stand(row.a, a);
                if (!(last_is_fixed && b + 1 == count)) stand(row.b, b);
                rows_.push_back(row);
            }
        solver_.begin(rows_, bodies_);
    }

    void solve(double h) {
        solver_.observe();
        (void)solver_.approach(0.0, h, 1.0, 1.0);
    }
    struct Sums {
        Vec3 linear = Vec3::Zero(), angular = Vec3::Zero(), centre = Vec3::Zero();
        double mass = 0.0, kinetic = 0.0;
    };
    [[nodiscard]] Sums sums(std::size_t b) const {
        Sums sums;
        for (std::size_t n = 0; n < kNodes; ++n) {
            const Vec3 x(nodes_[b][n].x[0], nodes_[b][n].x[1], nodes_[b][n].x[2]), v(nodes_[b][n].v[0], nodes_[b][n].v[1], nodes_[b][n].v[2]);
            const double mass = 1.0 / inv_mass_[b][n];
            sums.mass += mass;
            sums.linear += mass * v;
            sums.angular += mass * x.cross(v);
            sums.centre += mass * x;
            sums.kinetic += 0.5 * mass * v.squaredNorm();
        }
        sums.centre /= sums.mass;
        return sums;
    }
    [[nodiscard]] std::size_t count() const { return count_; }

private:
    static constexpr std::size_t kNodes = 9, kMost = 4;
    static void stand(ContactSide& side, std::size_t b) {
        side.slot = static_cast<std::uint32_t>(b);
        side.feet = 1;
        side.share[0] = side.weight[0][0] = 1.0;
    }
    std::size_t count_;
    std::array<std::array<fem::NodeRecord, kNodes>, kMost> nodes_{};
    std::array<std::array<double, kNodes>, kMost> inv_mass_{};
    std::vector<GivingBody> bodies_;
    std::vector<ContactRow> rows_;
    ContactSolver solver_;
};

TEST(ContactSolver, HoldsBodiesAsWholesWithoutMomentOrEnergy) {
    std::mt19937_64 rng(29);
    std::uniform_real_distribution<double> decade(-5.0, -2.0);
    std::size_t held = 0;
    for (int round = 0; round < 400; ++round) {
        SCOPED_TRACE(fmt::format("seed 29, round {}", round));
        Wholes wholes(rng, 2 + static_cast<std::size_t>(round) % 3, false);
        Wholes::Sums before, after;
        const auto add = [&](Wholes::Sums& all) {
            for (std::size_t b = 0; b < wholes.count(); ++b) {
                const Wholes::Sums one = wholes.sums(b);
                all.linear += one.linear, all.angular += one.angular, all.kinetic += one.kinetic;
            }
        };
        const auto approach = [&] { // of the first two
            const Wholes::Sums a = wholes.sums(0), b = wholes.sums(1);
            return (b.centre - a.centre).normalized().dot(a.linear / a.mass - b.linear / b.mass);
        };
        add(before);
        const double came = approach();
        wholes.solve(std::pow(10.0, decade(rng)));
        add(after);
        EXPECT_LT((after.linear - before.linear).norm(), 1e-15);
        EXPECT_LT((after.angular - before.angular).norm(), 1e-16);
        EXPECT_LE(after.kinetic, before.kinetic * (1.0 + 1e-12));
        if (wholes.count() > 2) continue;
        if (came <= 0.0) EXPECT_EQ(after.kinetic, before.kinetic) << "they part";
        held += came > 0.0;
        if (came > 0.0) EXPECT_LT(approach(), came);
        EXPECT_GT(approach(), std::min(came, 0.0) - 1e-12) << "it is stopped, not thrown back";
    }
    EXPECT_GT(held, 20u);
}

TEST(ContactSolver, StopsWhatIsHeldAgainstAFixedOneAndItsTurningUnlessItLeaves) {
    std::mt19937_64 rng(30);
    std::size_t stopped = 0, left = 0;
    for (int round = 0; round < 300; ++round) {
        SCOPED_TRACE(fmt::format("seed 30, round {}", round));
        Wholes wholes(rng, 2, true);
        const Wholes::Sums before = wholes.sums(0);
        wholes.solve(0.02); // longer than any stop takes
        const Wholes::Sums after = wholes.sums(0);
        EXPECT_LE(after.kinetic, before.kinetic * (1.0 + 1e-12));
        if (after.kinetic == before.kinetic) {
            ++left;
            continue;
        }
        ++stopped;
        EXPECT_LT(after.linear.norm(), 1e-12 * before.linear.norm());
        EXPECT_LT((after.angular - after.centre.cross(after.linear)).norm(), 1e-12);
    }
    EXPECT_GT(stopped, 50u);
    EXPECT_GT(left, 50u);
}

/// Clouds of tetrahedra, and many places between each two clouds: some press, most are far.
class Places {
public:
    /// free   no node is fixed, and no place is against what stands still
    Places(std::mt19937_64& rng, double friction, bool free) {
        std::uniform_real_distribution<double> unit(-1.0, 1.0), mass(0.5e-3, 3e-3), gap(-2e-4, 1e-2);
        std::uniform_int_distribution<Index> any(0, kTets - 1);
        for (std::size_t b = 0; b < kBodies; ++b) {
            const Vec3 at(0.05 * static_cast<double>(b), 0.0, 0.0), along(unit(rng), unit(rng), unit(rng));
            for (std::size_t n = 0; n < kNodes; ++n) {
                for (int axis = 0; axis < 3; ++axis) {
                    nodes_[b][n].x[axis] = at[axis] + 0.01 * unit(rng);
                    nodes_[b][n].v[axis] = along[axis] + 0.05 * unit(rng);
                }
                inv_mass_[b][n] = n == 0 && !free ? 0.0 : 1.0 / mass(rng);
            }
            bodies_.push_back({nodes_[b], inv_mass_[b].data()});
        }
        for (int k = 0; k < 200; ++k) {
            ContactRow row;
            const std::size_t a = static_cast<std::size_t>(k) % kBodies, b = (a + 1 + static_cast<std::size_t>(k / 7) % (kBodies - 1)) % kBodies;
            stand(row.a, a, any(rng), rng);
            if (k % 11 != 0 || free) stand(row.b, b, any(rng), rng);
            row.normal = Vec3(unit(rng), unit(rng), unit(rng)).normalized();
            row.gap = gap(rng);
            row.recovery = 2e-3;
            row.friction = friction;
            rows_.push_back(row);
        }
        solver_.begin(rows_, bodies_);
        solver_.observe();
    }

    /// Forces that know nothing of contact.
    void kick(std::mt19937_64& rng) {
        std::uniform_real_distribution<double> change(-0.05, 0.05);
        for (std::size_t b = 0; b < kBodies; ++b)
            for (std::size_t n = 0; n < kNodes; ++n)
                for (int axis = 0; axis < 3; ++axis)
                    if (inv_mass_[b][n] > 0.0) nodes_[b][n].v[axis] += change(rng);
    }
    ContactSolve approach(double h, double ratio, double spare) { return solver_.approach(time_, h, ratio, spare); }
    void drift(double h) {
        for (auto& body : nodes_)
            for (fem::NodeRecord& node : body)
                for (int axis = 0; axis < 3; ++axis) node.x[axis] += h * node.v[axis];
        time_ += h;
    }
    /// Each solve takes its least number of iterations.
    void hurry() { solver_.limit_rows(0); }
    struct Sums {
        double kinetic = 0.0;
        Vec3 linear = Vec3::Zero();
    };
    [[nodiscard]] Sums sums() const {
        Sums sums;
        for (std::size_t b = 0; b < kBodies; ++b)
            for (std::size_t n = 0; n < kNodes; ++n) {
                if (!(inv_mass_[b][n] > 0.0)) continue;
                const Vec3 v(nodes_[b][n].v[0], nodes_[b][n].v[1], nodes_[b][n].v[2]), p = v / inv_mass_[b][n];
                sums.kinetic += 0.5 * p.dot(v);
                sums.linear += p;
            }
        return sums;
    }
    [[nodiscard]] double gap(const ContactRow& row) const {
        return row.gap + row.normal.dot(moved(row.a) - moved(row.b));
    }
    [[nodiscard]] const std::vector<ContactRow>& rows() const { return rows_; }

private:
    static constexpr std::size_t kBodies = 3, kTets = 8, kNodes = 4 * kTets;
    [[nodiscard]] Vec3 position(std::size_t b, Index n) const { return Vec3(nodes_[b][n].x[0], nodes_[b][n].x[1], nodes_[b][n].x[2]); }
    [[nodiscard]] Vec3 moved(const ContactSide& side) const {
        if (!side.gives()) return Vec3::Zero();
        return side.image([&](Index n) { return position(side.slot, n); }) - side.start;
    }
    void stand(ContactSide& side, std::size_t b, Index tet, std::mt19937_64& rng) {
        std::uniform_real_distribution<double> share(-0.1, 1.0);
        side.slot = static_cast<std::uint32_t>(b);
        side.owner = b;
        side.feet = 1;
        side.share[0] = 1.0;
        for (Index k = 0; k < 4; ++k) side.record[0][k] = 4 * tet + k;
        double sum = 0.0;
        do {
            for (double& weight : side.weight[0]) weight = share(rng);
            sum = std::accumulate(side.weight[0], side.weight[0] + 4, 0.0);
        } while (sum < 0.5);
        for (double& weight : side.weight[0]) weight /= sum;
        side.start = side.image([&](Index n) { return position(b, n); });
    }

    std::array<std::array<fem::NodeRecord, kNodes>, kBodies> nodes_{};
    std::array<std::array<double, kNodes>, kBodies> inv_mass_{};
    std::vector<GivingBody> bodies_;
    std::vector<ContactRow> rows_;
    ContactSolver solver_;
    double time_ = 0.0;
};

/// A place that is left out because it is far must not be passed, whatever the others' impulses make of the velocities, and where a solve ends early.
TEST(ContactSolver, WhatItLeavesOutIsNotPassed) {
    constexpr double kStep = 1e-3;
    std::mt19937_64 rng(29);
    std::size_t solved = 0, far = 0;
    for (int round = 0; round < 90; ++round) {
        SCOPED_TRACE(fmt::format("seed 29: round {}", round));
        Places places(rng, round % 2 ? 0.3 : 0.0, false);
        const bool hurried = round % 3 == 2;
        if (hurried) places.hurry();
        for (int step = 0; step < 12; ++step) {
            std::vector<double> before;
            for (const ContactRow& row : places.rows()) before.push_back(places.gap(row));
            places.kick(rng);
            const ContactSolve solve = places.approach(kStep, 1.0, hurried ? 0.0 : 1.0);
            places.drift(kStep);
            for (std::size_t k = 0; k < before.size(); ++k) {
                const ContactRow& row = places.rows()[k];
                if (row.mobility > 0.0) {
                    ++solved;
                    continue;
                }
                ++far;
                EXPECT_GT(std::max(before[k], places.gap(row)), 0.0) << "m, place " << k << " in sub-step " << step << ": what is passed is solved";
                if (solve.converged) EXPECT_GT(places.gap(row), 0.0) << "m, place " << k << " in sub-step " << step;
            }
        }
    }
    EXPECT_GT(solved, 1000u);
    EXPECT_GT(far, 1000u) << "most of them are far";
}

/// Few iterations, and starts that are too large: the bodies gain no more than contact may give, and keep their momentum.
TEST(ContactSolver, ASolveThatEndsEarlyGivesNoEnergyBeyondWhatItMay) {
    std::mt19937_64 rng(30);
    std::size_t early = 0;
    for (int round = 0; round < 100; ++round) {
        Places places(rng, round % 2 ? 0.3 : 0.0, true);
        places.hurry();
        for (int step = 0; step < 8; ++step) {
            SCOPED_TRACE(fmt::format("seed 30: round {}, sub-step {}", round, step));
            const double spare = step % 3 == 0 ? 1e-6 : 0.0;
            const Places::Sums before = places.sums();
            const ContactSolve solve = places.approach(1e-3, 1.0 + 0.5 * step, spare);
            const Places::Sums after = places.sums();
            EXPECT_LT((after.linear - before.linear).norm(), 1e-12) << "N s";
            early += !solve.converged;
            if (!solve.converged) EXPECT_LE(after.kinetic - before.kinetic, spare + 1e-12) << "J";
            places.drift(1e-3);
        }
    }
    EXPECT_GT(early, 100u);
}

} // namespace
} // namespace trocar::engine
