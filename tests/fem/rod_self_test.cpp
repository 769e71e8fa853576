// A rod that meets itself: laws over random crumpled rods, step lengths and stiffnesses, and the parts against brute force.
#include "fem/rod/conjugate_gradients.hpp"
#include "fem/rod/rod.hpp"
#include "fem/rod/rod_band.hpp"
#include "fem/rod/rod_parts.hpp"
#include "fem/rod/self_contact.hpp"
#include "tests/fem/rod_apart.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace trocar::fem {
namespace {

/// Of Gauss' integral over all pairs of segments (Klenin & Langowski 2000): it changes by 2 where a part passes through another one.
double writhe(const std::vector<Vec3>& x) {
    double sum = 0.0;
    const auto unit = [](const Vec3& v) { const double l = v.norm(); return l > 0.0 ? Vec3(v / l) : Vec3(Vec3::Zero()); };
    const auto arc = [](double s) { return std::asin(std::clamp(s, -1.0, 1.0)); };
    for (std::size_t i = 0; i + 1 < x.size(); ++i)
        for (std::size_t j = i + 2; j + 1 < x.size(); ++j) {
            const Vec3 r13 = x[j] - x[i], r14 = x[j + 1] - x[i], r23 = x[j] - x[i + 1], r24 = x[j + 1] - x[i + 1];
            const Vec3 n1 = unit(r13.cross(r14)), n2 = unit(r14.cross(r24)), n3 = unit(r24.cross(r23)), n4 = unit(r23.cross(r13));
            const double area = arc(n1.dot(n2)) + arc(n2.dot(n3)) + arc(n3.dot(n4)) + arc(n4.dot(n1));
            const double sign = (x[j + 1] - x[j]).cross(x[i + 1] - x[i]).dot(r13);
            sum += sign > 0.0 ? area : sign < 0.0 ? -area : 0.0;
        }
    return sum / (2.0 * std::numbers::pi);
}

/// Of the writhe, between two of many moments of a straight motion.
double largest_jump(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
    double last = writhe(from), jump = 0.0;
    const bool close = std::abs(writhe(to) - last) < 0.3; // what passes through by 2 and back by as much is two passages in one step
    const int moments = close ? 1 : 40;
    std::vector<Vec3> at(from.size());
    for (int m = 1; m <= moments; ++m) {
        const double t = double(m) / moments;
        for (std::size_t i = 0; i < at.size(); ++i) at[i] = (1.0 - t) * from[i] + t * to[i];
        const double now = writhe(at);
        jump = std::max(jump, std::abs(now - last));
        last = now;
    }
    return jump;
}

TEST(ChainBoxes, ListThePairsThatBruteForceFinds) {
    Dice dice(5);
    ChainBoxes boxes;
    std::vector<SegmentPair> pairs;
    std::size_t found = 0;
    for (int k = 0; k < 60; ++k) {
        const std::size_t nodes = 2 + static_cast<std::size_t>(dice.between(0, 90));
        std::vector<Vec3> axis{Vec3::Zero()};
        while (axis.size() < nodes) axis.push_back(axis.back() + 1e-3 * dice.direction());
        std::vector<double> reach(nodes);
        for (double& r : reach) r = dice.between(0, 1e-3);
        const ChainRule rule{dice.between(1e-4, 2e-3), 1e-3};
        const double within = dice.between(0, 2e-3);
        boxes.find_pairs(axis, rule, within, reach, pairs);
        std::vector<std::pair<Index, Index>> wanted, listed;
        for (Index i = 0; i + 1 < nodes; ++i)
            for (Index j = i + rule.least_gap(); j + 1 < nodes; ++j)
                if (distance_by_search(axis[i], axis[i + 1], axis[j], axis[j + 1]) <
                    within + std::max(reach[i], reach[i + 1]) + std::max(reach[j], reach[j + 1]))
                    wanted.emplace_back(i, j);
        for (const SegmentPair& pair : pairs) listed.emplace_back(pair.a, pair.b);
        EXPECT_EQ(listed, wanted) << "chain " << k;
        found += listed.size();
    }
    EXPECT_GT(found, 1000u);
}

TEST(ShareApart, IsOfAMotionThatKeepsItsDistanceAndIsAllOfOneThatStaysAway) {
    Dice dice(6);
    int all = 0, part = 0;
    for (int k = 0; k < 3000; ++k) {
        std::array<Vec3, 4> from, to;
        for (Vec3& p : from) p = dice.point(1.0);
        for (std::size_t c = 0; c < 4; ++c) to[c] = from[c] + dice.point(dice.between(0.0, 1.0));
        const double limit = dice.between(0.01, 0.3), share = share_apart(from, to, limit);
        double nearest = 10.0, nearest_proven = 10.0;
        for (int sample = 0; sample <= 100; ++sample) {
            const double t = 0.01 * sample;
            std::array<Vec3, 4> at;
            for (std::size_t c = 0; c < 4; ++c) at[c] = (1.0 - t) * from[c] + t * to[c];
            const double distance = distance_by_search(at[0], at[1], at[2], at[3]);
            nearest = std::min(nearest, distance);
            if (t <= share) nearest_proven = std::min(nearest_proven, distance);
        }
        if (share > 0.0) EXPECT_GE(nearest_proven, limit * (1.0 - 1e-9)) << k;
        if (nearest < limit) EXPECT_LT(share, 1.0) << k;
        if (nearest > 1.1 * limit) EXPECT_EQ(share, 1.0) << k << ": " << nearest << " for " << limit;
        all += share == 1.0, part += share > 0.0 && share < 1.0;
    }
    EXPECT_GT(all, 300);
    EXPECT_GT(part, 100);
}

/// A band of random stiffness and random couplings between its nodes, against a dense solver; and every iterate has x . b = x . A x.
TEST(ConjugateGradients, SolveABandWithCouplingsAsADenseSolverDoes) {
    Dice dice(7);
    for (int k = 0; k < 40; ++k) {
        const auto nodes = static_cast<std::size_t>(dice.between(8, 40)), size = 3 * nodes;
        const auto first = static_cast<Index>(dice.between(0, 3));
        std::vector<double> storage(size * (kRodBandwidth + 1));
        RodBand band(storage, nodes);
        Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(static_cast<int>(size), static_cast<int>(size));
        const auto add = [&](std::size_t i, std::size_t j, const Mat3& m) { // to (i, j) and by symmetry to (j, i)
            band.add(i, j, m);
            dense.block<3, 3>(static_cast<int>(3 * i), static_cast<int>(3 * j)) += m;
            if (i != j) dense.block<3, 3>(static_cast<int>(3 * j), static_cast<int>(3 * i)) += m.transpose();
        };
        for (std::size_t i = 0; i < nodes; ++i) {
            add(i, i, Mat3(dice.between(0.5, 2.0) * Mat3::Identity()));
            if (i == 0) continue;
            const Mat3 link = std::pow(10.0, dice.between(-1, 2)) * Mat3::Identity();
            add(i, i, link), add(i - 1, i - 1, link), add(i, i - 1, Mat3(-link));
        }
        std::vector<RodCoupling> couplings;
        for (int c = 0; c < 6; ++c) {
            const auto a = static_cast<Index>(dice.between(0, double(nodes) - 5)), b = static_cast<Index>(dice.between(a + 3, double(nodes) - 1));
            const Vec3 n = dice.direction();
            const RodCoupling pair{a + first, b + first, dice.between(0, 1), dice.between(0, 1), Mat3(std::pow(10.0, dice.between(-1, 2)) * n * n.transpose())};
            const auto side = [&](Index node, double weight, Index other, double other_weight, double sign, bool banded) {
                for (Index u = 0; u < 2; ++u)
                    for (Index v = 0; v < 2; ++v) {
                        const Mat3 m = sign * (u == 0 ? 1.0 - weight : weight) * (v == 0 ? 1.0 - other_weight : other_weight) * pair.stiffness;
                        if (banded && v > u) continue;
                        if (banded)
                            add(node + u, other + v, m);
                        else
                            dense.block<3, 3>(static_cast<int>(3 * (node + u)), static_cast<int>(3 * (other + v))) += m;
                    }
            };
            side(a, pair.weight, a, pair.weight, 1.0, true), side(b, pair.other_weight, b, pair.other_weight, 1.0, true);
            side(a, pair.weight, b, pair.other_weight, -1.0, false), side(b, pair.other_weight, a, pair.weight, -1.0, false);
            couplings.push_back(pair);
        }
        Eigen::VectorXd b(static_cast<int>(size));
        for (int r = 0; r < b.size(); ++r) b[r] = dice.between(-1, 1);
        std::vector<double> x(b.data(), b.data() + b.size());
        RodWorkspace work;
        size_workspace(nodes, work);
        band.solve(x);
        const unsigned iterations = conjugate_gradients(band, std::span<const double>(b.data(), size), x, work, [&](std::span<const double> p, std::span<double> out) {
            couple_places<kRodCoordinates>(couplings, first, p, out);
        });
        const Eigen::VectorXd found = Eigen::Map<const Eigen::VectorXd>(x.data(), b.size()), wanted = dense.ldlt().solve(b);
        const auto energy = [&](const Eigen::VectorXd& v) { return v.dot(dense * v); };
        EXPECT_LT(std::sqrt(energy(found - wanted) / energy(wanted)), 0.1) << k << " after " << iterations;
        EXPECT_NEAR(found.dot(b), energy(found), 1e-9 * energy(found)) << k;
        EXPECT_GE(iterations, 1u);
    }
}

struct Crumple {
    RodDesign design;
    double step = 0.01, pull = 0.0, friction = 0.0;
};

Crumple random_crumple(Dice& dice, bool torsion) {
    Crumple c;
    c.design.length = 0.12;
    c.design.radius = dice.between(0.3e-3, 0.8e-3);
    c.design.segment = dice.between(1.2e-3, 2.5e-3);
    c.design.young_modulus = std::pow(10.0, dice.between(5.5, 7.5));
    c.design.tip = TipShape::Pigtail;
    c.design.tip_length = 0.1;
    c.design.tip_angle = dice.between(6.0, 20.0);
    c.design.tip_stiffness = 1.0;
    c.design.torsion = torsion;
    c.step = std::pow(10.0, dice.between(-3.0, -2.0));
    c.friction = dice.between(0.0, 1.0) < 0.5 ? 0.0 : dice.between(0.05, 0.4);
    c.pull = dice.between(2.0, 30.0);
    return c;
}

/// Pulls every node towards a point that wanders, and reports what the rod does.
class CrumpledRod {
public:
    CrumpledRod(const Crumple& c, unsigned seed) : crumple_(c), dice_(seed), model_(*make_rod_model(c.design)) {
        place_rod(model_, {}, 0.9 * c.design.length, 0.0, state_);
        drive_.insertion = state_.insertion;
        drive_.friction = c.friction;
        force_.resize(model_.node_count());
    }
    void step() {
        const double weight = crumple_.pull * crumple_.design.young_modulus * std::pow(crumple_.design.radius, 4.0) / 0.02;
        if (dice_.between(0, 1) < 0.05) centre_ = Vec3(0, 0, 0.05) + dice_.point(0.02);
        for (std::size_t i = 0; i < force_.size(); ++i) force_[i] = weight / 0.02 * (centre_ - state_.position[i]);
        drive_.force = force_;
        const RodState start = state_;
        for (RodPlane& plane : planes_) plane.start_force = plane.force, plane.start_drag = plane.drag;
        drive_.rough = true;
        report = solve_rod(model_, state_, crumple_.step, 1, drive_, {}, work_, planes_);
        drive_.rough = false;
        self.begin(model_, start.position, state_.position, crumple_.step);
        self.list_planes(model_, start.position, state_.position, planes_);
        for (rounds = 0; rounds < 6; ++rounds) {
            state_ = start;
            for (RodPlane& plane : planes_) plane.force = plane.start_force, plane.drag = plane.start_drag;
            report = solve_rod(model_, state_, crumple_.step, 1, drive_, {}, work_, planes_);
            if (self.check(model_, start.position, state_.position, planes_)) break;
        }
        share = self.proven_share();
        if (share < 1.0)
            for (std::size_t i = 0; i < force_.size(); ++i) {
                state_.position[i] = start.position[i] + 0.9 * share * (state_.position[i] - start.position[i]);
                state_.velocity[i] *= 0.9 * share;
            }
        self.end();
    }

    [[nodiscard]] const RodState& state() const { return state_; }
    [[nodiscard]] const RodModel& model() const { return model_; }
    [[nodiscard]] const std::vector<RodPlane>& planes() const { return planes_; }
    [[nodiscard]] double pressing() const {
        double sum = 0.0;
        for (const RodPlane& plane : planes_) sum += plane.force > 0.0;
        return sum;
    }

    RodReport report;
    SelfContact self;
    unsigned rounds = 0;
    double share = 1.0;

private:
    Crumple crumple_;
    Dice dice_;
    RodModel model_;
    RodState state_;
    RodDrive drive_;
    RodWorkspace work_;
    std::vector<RodPlane> planes_;
    std::vector<Vec3> force_;
    Vec3 centre_{0.01, 0.0, 0.05};
};

void crumple_and_check(bool torsion, unsigned seed) {
    Dice dice(seed);
    std::size_t steps = 0, held = 0, unconverged = 0;
    double pressing = 0.0, iterations = 0.0, inner = 0.0, nearest = 1.0;
    for (unsigned k = 0; k < 8; ++k) {
        const Crumple c = random_crumple(dice, torsion);
        CrumpledRod rod(c, seed + 100 + k);
        const std::size_t gap = ChainRule{c.design.radius, rod.model().segment}.least_gap();
        for (int step = 0; step < 250; ++step) {
            const std::vector<Vec3> before = rod.state().position;
            rod.step();
            ASSERT_EQ(rod.report.first_bad_node, kNoIndex) << k << ", " << step;
            const double apart = nearest_by_search(rod.state().position, gap) / (2.0 * c.design.radius);
            ASSERT_GE(apart, 0.99) << "rod " << k << ", step " << step;
            ASSERT_LT(largest_jump(before, rod.state().position), 1.0) << "rod " << k << ", step " << step << " passed through itself";
            nearest = std::min(nearest, apart);
            ++steps, held += rod.share < 1.0, unconverged += rod.report.unconverged;
            pressing += rod.pressing(), iterations += rod.report.iterations, inner += rod.report.inner_iterations;
        }
    }
    const double each = 1.0 / static_cast<double>(steps);
    std::printf("margin: %.1f places press, %.1f iterations and %.0f inner ones a step, %zu of %zu held back, %zu stages unsettled; nearest %.4f diameters\n",
                each * pressing, each * iterations, each * inner, held, steps, unconverged, nearest);
    EXPECT_GT(each * pressing, 0.5);
    EXPECT_LT(held, steps / 50);
    EXPECT_LT(unconverged, steps / 7); // of a rod that is pulled so and does not meet itself: 210 and 253
}

TEST(RodSelf, NoPartOfACrumpledRodPassesThroughAnotherOne) { crumple_and_check(false, 11); }
TEST(RodSelf, NorDoesOneThatTwists) { crumple_and_check(true, 12); }

} // namespace
} // namespace trocar::fem
