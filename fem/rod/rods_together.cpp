#include "fem/rod/rods_together.hpp"

#include "fem/rod/bore_contact.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trocar::fem {

namespace {

/// Ratios of segments beyond this make a step allocate.
constexpr double kMostSegments = 50.0;

/// The bands of all rods, one after another; or the joint one.
class BandOfAll {
public:
    BandOfAll(std::span<RodOfMany> rods, JointBand& joint) noexcept : rods_(rods), joint_(joint) {}
    bool is_joint = false;

    void solve_again(std::span<double> x, std::size_t) noexcept {
        if (is_joint) {
            joint_.solve(x);
            return;
        }
        for (RodOfMany& rod : rods_) {
            rod.part().solve_again(x.first(rod.part().size()));
            x = x.subspan(rod.part().size());
        }
    }

private:
    std::span<RodOfMany> rods_;
    JointBand& joint_;
};

/// One stage of all rods.
class StepOfAll {
public:
    StepOfAll(std::span<const SolvedRod> solved, std::span<RodMeeting> meetings, std::span<RodOfMany> rods, TogetherWorkspace& work) noexcept
        : solved_(solved), meetings_(meetings), rods_(rods), work_(work), all_(rods, work.joint) {
        std::size_t size = 0;
        for (std::size_t r = 0; r < rods.size(); ++r) from_[r] = size, size += part(r).size();
        size_ = size;
        for (auto* list : {&work.all.rhs, &work.all.residual, &work.all.remainder, &work.all.guess, &work.all.direction, &work.all.banded, &work.all.solution})
            if (list->size() < size) list->resize(size); // never shrinks
        work.presses.resize(std::max(work.presses.size(), meetings.size()));
        for (std::size_t k = 0; k < meetings.size(); ++k) begin_meeting(k);
    }

    /// Returns whether positions and contact forces settled.
    bool solve() noexcept {
        double correction = 0.0, change = 0.0;
        std::array<double, kMostTogether> farthest_sq{};
        bool settled = false;
        for (unsigned iteration = 0; iteration < kMaxNewton; ++iteration) {
            for (std::size_t r = 0; r < rods_.size(); ++r) farthest_sq[r] = std::max(farthest_sq[r], part(r).farthest_from_start_sq());
            evaluate(iteration == 0);
            if (iteration > 0) {
                const double largest = largest_force();
                const bool bounds = correction <= kBoundWithin;
                change = update(bounds);
                settled = solved_[0].drive.rough ? correction <= kRoughTolerance
                                                 : correction <= kNewtonTolerance && change <= std::max(kForceTolerance * largest, kLeastForce);
                if (settled) break;
                if (bounds) evaluate(false);
            }
            for (const SolvedRod& rod : solved_) ++rod.report.iterations;
            find_correction();
            correction = apply_correction();
        }
        stay_in_cone();
        for (std::size_t r = 0; r < rods_.size(); ++r) {
            RodReport& report = solved_[r].report;
            report.farthest_m += std::sqrt(farthest_sq[r]);
            report.unconverged += !settled;
            report.largest_residual = std::max(report.largest_residual, correction);
            report.force_error = std::max(report.force_error, change);
        }
        return settled;
    }

    void balance() noexcept {
        for (std::size_t r = 0; r < rods_.size(); ++r) part(r).begin_balance();
        std::array<Vec3, kMostTogether> pressed;
        pressed.fill(Vec3::Zero());
        push_meetings();
        for (std::size_t k = 0; k < meetings_.size(); ++k) {
            pressed[press(k).part[0]] += force(k);
            pressed[press(k).part[1]] -= force(k);
        }
        for (std::size_t r = 0; r < rods_.size(); ++r) part(r).end_balance(pressed[r], solved_[r].report);
    }

private:
    [[nodiscard]] RodPart& part(std::size_t r) noexcept { return rods_[r].part(); }
    [[nodiscard]] MeetingPress& press(std::size_t k) noexcept { return work_.presses[k]; }
    [[nodiscard]] RodPart& part_of(std::size_t k, int side) noexcept { return part(press(k).part[side]); }
    [[nodiscard]] Vec3 force(std::size_t k) const noexcept { return meetings_[k].plane.force * meetings_[k].plane.normal + meetings_[k].plane.drag; }
    /// Of one of its loads.
    [[nodiscard]] Vec3 force(std::size_t k, std::size_t j) const noexcept {
        const RodPlane& plane = meetings_[k].plane;
        if (work_.presses[k].loads == 1) return force(k);
        return j == 0 ? Vec3(plane.force * plane.normal) : plane.drag;
    }
    [[nodiscard]] Mat3 stiffness(std::size_t k, std::size_t j) const noexcept {
        const MeetingPress& own = work_.presses[k];
        if (j == 1) return own.press.aside;
        const Vec3& normal = meetings_[k].plane.normal;
        const Mat3 across = own.press.stiffness * normal * normal.transpose();
        return own.loads == 1 ? Mat3(across + own.press.aside) : Mat3(across + own.turning);
    }
    [[nodiscard]] double bound_of(std::size_t k, double force) noexcept { return press(k).friction * meetings_[k].plane.friction_share * force; }
    [[nodiscard]] Index find_part(Index id) const noexcept {
        Index r = 0;
        while (r + 1 < solved_.size() && solved_[r].id != id) ++r;
        return r;
    }

    /// Where both touch lies between the axes as their radii divide it; in a bore at the inner rod's radius.
    void begin_meeting(std::size_t k) noexcept {
        RodPlane& plane = meetings_[k].plane;
        const bool in_bore = meetings_[k].play > 0.0;
        MeetingPress& own = press(k);
        own.part[0] = find_part(meetings_[k].rod), own.part[1] = find_part(meetings_[k].other_rod);
        const SolvedRod &a = solved_[own.part[0]], &b = solved_[own.part[1]];
        const auto on_axis = [](const SolvedRod& rod, Index node, double weight) {
            return Vec3((1.0 - weight) * rod.workspace.start[node] + weight * rod.workspace.start[node + 1]);
        };
        const double apart = plane.normal.dot(on_axis(a, plane.node, plane.weight) - on_axis(b, plane.other, plane.other_weight));
        const double ra = a.model.design.radius, rb = b.model.design.radius, lever = in_bore ? ra : apart * ra / (ra + rb);
        own.loads = in_bore ? 2 : 1;
        own.load[0] = {{part_of(k, 0).place(plane.node, plane.weight, -lever * plane.normal),
                        part_of(k, 1).place(plane.other, plane.other_weight, (apart - lever) * plane.normal)}};
        if (in_bore) {
            own.load[1] = own.load[0];
            own.load[0] = {{part_of(k, 0).place(plane.node, plane.weight, Vec3::Zero()), part_of(k, 1).place(plane.other, plane.other_weight, Vec3::Zero())}};
        }
        own.across = (in_bore ? kBoreAugmentation : kSelfAugmentation) * std::sqrt(part_of(k, 0).stiffness() * part_of(k, 1).stiffness());
        own.softness = 0.5 / a.drive.contact_stiffness + 0.5 / b.drive.contact_stiffness;
        own.friction = std::sqrt(a.drive.friction * b.drive.friction);
        begin_press(plane, own.press, bound_of(k, plane.force));
    }

    /// m, by which it is beyond its limit, along the plane's normal; in a bore that is towards the axis first.
    [[nodiscard]] double turn_to_limit(std::size_t k, double& aside) noexcept {
        RodMeeting& meeting = meetings_[k];
        RodPlane& plane = meeting.plane;
        const MeetingLoad& load = press(k).load[0];
        Vec3 apart = part_of(k, 0).point(load.place[0]) - part_of(k, 1).point(load.place[1]);
        if (!(meeting.play > 0.0)) return plane.offset - plane.normal.dot(apart);
        apart += meeting.beside;
        apart -= meeting.along.dot(apart) * meeting.along;
        aside = std::sqrt(apart.squaredNorm());
        if (aside > kLeastAside * meeting.play) plane.normal = -apart / aside;
        return aside - meeting.play;
    }

    void evaluate_meetings(bool held) noexcept {
        for (std::size_t k = 0; k < meetings_.size(); ++k) {
            RodPlane& plane = meetings_[k].plane;
            MeetingPress& own = press(k);
            double aside = 0.0;
            const double depth = turn_to_limit(k, aside);
            evaluate_press(plane, own.press, depth, own.across, own.softness, bound_of(k, own.press.bounding), held && own.press.force > 0.0, [&] {
                const MeetingLoad& load = own.load[own.loads - 1];
                const Vec3 moved = part_of(k, 0).displacement(load.place[0]) - part_of(k, 1).displacement(load.place[1]);
                const double turned = is_in_bore(k) ? plane.normal.dot(own.press.anchor) : 0.0; // the anchor is across the normal of before
                return Vec3(moved - (plane.normal.dot(moved) + turned) * plane.normal);
            });
            own.turning.setZero();
            if (!(aside > kLeastAside * meetings_[k].play) || !(plane.force > 0.0)) continue;
            const Vec3 way = meetings_[k].along.cross(plane.normal);
            own.turning = plane.force / aside * way * way.transpose();
        }
    }
    void evaluate(bool held) noexcept {
        for (std::size_t r = 0; r < rods_.size(); ++r) part(r).evaluate(held);
        evaluate_meetings(held);
    }
    [[nodiscard]] double largest_force() noexcept {
        double largest = 0.0;
        for (std::size_t r = 0; r < rods_.size(); ++r) largest = std::max(largest, part(r).largest_force());
        for (const RodMeeting& meeting : meetings_) largest = std::max(largest, meeting.plane.force);
        return largest;
    }
    [[nodiscard]] double update(bool bounds) noexcept {
        double change = 0.0;
        for (std::size_t r = 0; r < rods_.size(); ++r) change = std::max(change, part(r).update(bounds));
        for (std::size_t k = 0; k < meetings_.size(); ++k) change = std::max(change, update_press(meetings_[k].plane, press(k).press, bounds));
        return change;
    }
    void stay_in_cone() noexcept {
        for (std::size_t r = 0; r < rods_.size(); ++r) part(r).stay_in_cone();
        for (std::size_t k = 0; k < meetings_.size(); ++k) {
            RodPlane& plane = meetings_[k].plane;
            const double most = bound_of(k, plane.force), drag = std::sqrt(plane.drag.squaredNorm());
            if (drag > most) plane.drag *= most / drag;
        }
    }

    void push_meetings() noexcept {
        for (std::size_t k = 0; k < meetings_.size(); ++k) {
            RodPress& own = press(k).press;
            own.pushed = own.pushes;
            if (!own.pushes) continue;
            for (std::size_t j = 0; j < press(k).loads; ++j) {
                MeetingLoad& load = press(k).load[j];
                load.start_force = force(k, j);
                load.start_stiffness = stiffness(k, j);
                part_of(k, 0).push_place(load.place[0], load.start_force, load.start_stiffness);
                part_of(k, 1).push_place(load.place[1], -load.start_force, load.start_stiffness);
            }
        }
    }

    template <class List>
    [[nodiscard]] auto of(std::size_t r, List list) noexcept {
        return list.subspan(from_[r], part(r).size());
    }

    void find_correction() noexcept {
        const std::span<double> b = std::span(work_.all.residual).first(size_), x = std::span(work_.all.rhs).first(size_);
        bool coupled = false;
        for (std::size_t r = 0; r < rods_.size(); ++r) part(r).assemble();
        push_meetings();
        all_.is_joint = false;
        for (std::size_t k = 0; k < meetings_.size(); ++k) {
            coupled = coupled || (press(k).press.pushed && !is_in_bore(k));
            all_.is_joint = all_.is_joint || (press(k).press.pushed && is_in_bore(k));
        }
        for (std::size_t r = 0; r < rods_.size(); ++r) {
            if (all_.is_joint)
                part(r).copy_right_side(of(r, b));
            else
                part(r).solve_band(of(r, b), of(r, x));
            coupled = coupled || part(r).is_coupled();
        }
        if (all_.is_joint) {
            factorise_joint();
            std::copy(b.begin(), b.end(), x.begin());
            work_.joint.solve(x);
        }
        if (coupled) {
            const unsigned inner = conjugate_gradients(all_, std::span<const double>(b), x, work_.all,
                                                       [&](std::span<const double> p, std::span<double> out) { couple(p, out); });
            for (const SolvedRod& rod : solved_) rod.report.inner_iterations += inner;
        }
        power_ = 0.0;
        for (std::size_t k = 0; k < size_; ++k) power_ += x[k] * b[k];
        for (std::size_t r = 0; r < rods_.size(); ++r) part(r).set_correction(of(r, x));
    }

    [[nodiscard]] bool is_in_bore(std::size_t k) const noexcept { return meetings_[k].play > 0.0; }

    /// All rods in one matrix, with what couples those in bores.
    void factorise_joint() {
        std::vector<JointBand::Node>& nodes = work_.nodes;
        nodes.clear(); // reserved
        for (std::size_t r = 0; r < rods_.size(); ++r)
            for (Index i = part(r).first(); i < solved_[r].model.node_count(); ++i)
                nodes.push_back({part(r).arc(i), chain_of(r), from_[r] + part(r).coordinates() * (i - part(r).first()), part(r).coordinates()});
        JointBand& joint = work_.joint;
        joint.order(nodes);
        for (std::size_t r = 0; r < rods_.size(); ++r) part(r).couple_band(from_[r], joint);
        for_each_bore_entry([&](std::size_t a, std::size_t b, double) { joint.couple(a, b); });
        joint.begin();
        for (std::size_t r = 0; r < rods_.size(); ++r) part(r).add_band(from_[r], joint);
        for_each_bore_entry([&](std::size_t a, std::size_t b, double value) { joint.add(a, b, value); });
        joint.factorise();
    }
    /// Rods in one another's bores are in order along one axis.
    [[nodiscard]] Index chain_of(std::size_t r) const noexcept {
        for (std::size_t k = 0; k < meetings_.size(); ++k)
            if (is_in_bore(k) && meetings_[k].rod == solved_[r].id) return find_part(meetings_[k].other_rod);
        return static_cast<Index>(r);
    }

    /// Calls entry(a, b, value) of what the coordinates of two rods feel of each other in a bore.
    template <class Entry>
    void for_each_bore_entry(const Entry& entry) noexcept {
        for (std::size_t k = 0; k < meetings_.size(); ++k) {
            const MeetingPress& own = press(k);
            if (!own.press.pushed || !is_in_bore(k)) continue;
            for (std::size_t j = 0; j < own.loads; ++j)
                for (int a = 0; a < 2; ++a)
                    for (int b = 0; b < 2; ++b) add_block(own, own.load[j], a, b, entry);
        }
    }
    template <class Entry>
    void add_block(const MeetingPress& own, const MeetingLoad& load, int a, int b, const Entry& entry) noexcept {
        const Index one = own.part[0], other = own.part[1];
        const Index i = load.place[0].node + static_cast<Index>(a), k = load.place[1].node + static_cast<Index>(b);
        if (i < part(one).first() || k < part(other).first()) return;
        const std::size_t row = from_[one] + part(one).coordinates() * (i - part(one).first());
        const std::size_t column = from_[other] + part(other).coordinates() * (k - part(other).first());
        for (std::size_t u = 0; u < part(one).coordinates(); ++u)
            for (std::size_t v = 0; v < part(other).coordinates(); ++v)
                entry(row + u, column + v, -motion_of(load.place[0], a, u).dot(load.start_stiffness * motion_of(load.place[1], b, v)));
    }
    /// How the place moves with a coordinate of its first or second node.
    [[nodiscard]] static Vec3 motion_of(const SurfacePlace& place, int node, std::size_t coordinate) noexcept {
        return coordinate < 3 ? Vec3(place.weight[node].col(static_cast<int>(coordinate))) : Vec3(place.share[node] * place.roll);
    }

    /// What each place feels of the other one's motion.
    void couple(std::span<const double> p, std::span<double> out) noexcept {
        for (std::size_t r = 0; r < rods_.size(); ++r)
            if (part(r).is_coupled()) part(r).couple_itself(of(r, p), of(r, out));
        for (std::size_t k = 0; k < meetings_.size(); ++k) {
            const MeetingPress& own = press(k);
            if (!own.press.pushed || is_in_bore(k)) continue; // those are in the joint matrix
            const MeetingLoad& load = own.load[0];
            for (int side = 0; side < 2; ++side) {
                const Index a = own.part[side], b = own.part[1 - side];
                const Vec3 moved = part(b).motion_at(load.place[1 - side], of(b, p));
                part(a).take_force(load.place[side], -(load.start_stiffness * moved), of(a, out));
            }
        }
    }

    /// Returns the largest correction, m, before it was shortened.
    double apply_correction() noexcept {
        double largest = 0.0, turned = 0.0, radius = 0.0;
        for (std::size_t r = 0; r < rods_.size(); ++r) {
            part(r).measure_correction(largest, turned);
            radius = std::max(radius, solved_[r].model.design.radius);
        }
        const double most = std::min({1.0, kTrustRadius / largest, kTrustAngle / turned}); // by 0: infinite
        move_by(most);
        search_along(most, power_, [&](double share) { return power_at(share); }, [&](double share) { move_by(share); });
        turn_alone();
        return std::max(largest, turned * radius);
    }

    void move_by(double share) noexcept {
        for (std::size_t r = 0; r < rods_.size(); ++r) part(r).move_by(share);
    }

    [[nodiscard]] double power_at(double share) noexcept {
        double power = (1.0 - share) * power_;
        for (std::size_t r = 0; r < rods_.size(); ++r) part(r).add_contact_power(share, power);
        evaluate_meetings(false);
        for (std::size_t k = 0; k < meetings_.size(); ++k) {
            const MeetingPress& own = press(k);
            if (!own.press.pushes && !own.press.pushed) continue;
            for (std::size_t j = 0; j < own.loads; ++j) {
                const MeetingLoad& load = own.load[j];
                Vec3 moved = part_of(k, 0).motion_at(load.place[0], of(own.part[0], std::span<const double>(work_.all.rhs)));
                moved -= part_of(k, 1).motion_at(load.place[1], of(own.part[1], std::span<const double>(work_.all.rhs)));
                Vec3 change = own.press.pushes ? force(k, j) : Vec3(Vec3::Zero());
                if (own.press.pushed) change += share * (load.start_stiffness * moved) - load.start_force;
                power += change.dot(moved);
            }
        }
        return power;
    }

    /// One rod's angles after another's: both at once would each turn all of the way.
    void turn_alone() noexcept {
        for (std::size_t r = 0; r < rods_.size(); ++r) {
            if (!part(r).begin_turns()) continue;
            evaluate_meetings(false);
            for (std::size_t k = 0; k < meetings_.size(); ++k) {
                if (!press(k).press.pushes) continue;
                const Vec3& drag = meetings_[k].plane.drag;
                const MeetingLoad& load = press(k).load[press(k).loads - 1];
                if (press(k).part[0] == r) part(r).push_turn(load.place[0], drag, press(k).press.aside);
                if (press(k).part[1] == r) part(r).push_turn(load.place[1], -drag, press(k).press.aside);
            }
            part(r).end_turns();
        }
    }

    std::span<const SolvedRod> solved_;
    std::span<RodMeeting> meetings_;
    std::span<RodOfMany> rods_;
    TogetherWorkspace& work_;
    BandOfAll all_;
    std::array<std::size_t, kMostTogether> from_{}; // of each rod's coordinates among all
    std::size_t size_ = 0;
    double power_ = 0.0; // J
};

void begin_stages(std::span<const SolvedRod> solved, std::span<RodOfMany> rods, unsigned k) noexcept {
    for (std::size_t r = 0; r < rods.size(); ++r) {
        const SolvedRod& rod = solved[r];
        RodStages& stages = *rods[r].stages;
        stages.begin(k);
        rods[r].twisted.reset(), rods[r].untwisted.reset();
        const auto make = [&](auto& slot, RodTwist* twist) {
            slot.emplace(rod.model, rod.state, rod.drive, rod.planes, rod.self, stages.dt(), stages.first(), stages.share(), rod.workspace, twist);
        };
        if (stages.twists())
            make(rods[r].twisted, &stages.twist());
        else
            make(rods[r].untwisted, nullptr);
    }
}

void end_stages(std::span<const SolvedRod> solved, std::span<const RodMeeting> meetings, bool settled, std::span<RodOfMany> rods) noexcept {
    for (std::size_t r = 0; r < rods.size(); ++r) {
        const auto touch_others = [&](auto&& touch) {
            for (const RodMeeting& meeting : meetings) {
                if (!(meeting.plane.force > 0.0)) continue;
                if (meeting.rod == solved[r].id) touch(meeting.plane.node, meeting.plane.weight);
                if (meeting.other_rod == solved[r].id) touch(meeting.plane.other, meeting.plane.other_weight);
            }
        };
        rods[r].stages->end(settled, solved[r].planes, solved[r].self, touch_others, solved[r].report);
    }
}

} // namespace

void reserve_together(std::size_t nodes, std::size_t meetings, double segments, TogetherWorkspace& work) {
    RodWorkspace& all = work.all;
    // A node meets the second one after it, and all that lies between: of the longer segments, and of the shorter ones beside them.
    const std::size_t between = 2 * static_cast<std::size_t>(std::ceil(std::min(segments, kMostSegments))) + 6;
    work.joint.reserve(kTwistedCoordinates * nodes, kTwistedCoordinates * nodes * kTwistedCoordinates * between);
    work.nodes.reserve(nodes);
    for (auto* list : {&all.rhs, &all.residual, &all.remainder, &all.guess, &all.direction, &all.banded, &all.solution})
        list->resize(kTwistedCoordinates * nodes);
    work.presses.reserve(meetings);
}

void solve_together(std::span<const SolvedRod> solved, std::span<RodMeeting> meetings, double step, TogetherWorkspace& work) noexcept {
    assert(!solved.empty() && solved.size() <= kMostTogether);
    const unsigned substeps = count_substeps(0.5 * step);
    const std::span<RodOfMany> rods = std::span(work.rods).first(solved.size());
    for (std::size_t r = 0; r < rods.size(); ++r) {
        solved[r].report = {};
        rods[r].stages.emplace(solved[r].model, solved[r].state, solved[r].drive, step, substeps, solved[r].workspace);
    }
    for (unsigned k = 0; k < 2 * substeps; ++k) {
        begin_stages(solved, rods, k);
        StepOfAll stage(solved, meetings, rods, work);
        const bool settled = stage.solve();
        if (k + 1 == 2 * substeps) stage.balance();
        end_stages(solved, meetings, settled, rods);
    }
    for (std::size_t r = 0; r < rods.size(); ++r) rods[r].stages->finish(solved[r].report);
}

} // namespace trocar::fem
