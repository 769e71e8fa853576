// Rods that are stepped together as the engine steps them.
#pragma once

#include "fem/rod/rod_meetings.hpp"
#include "fem/rod/rod_parts.hpp"
#include "tests/fem/rod_apart.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace trocar::fem {

struct RodAlone {
    RodAlone(const RodDesign& design, const RodPort& port, double insertion, double friction) : model(*make_rod_model(design)) {
        place_rod(model, port, insertion, 0.0, state);
        drive.port = port, drive.insertion = insertion, drive.friction = friction;
        force.assign(model.node_count(), Vec3::Zero());
    }
    [[nodiscard]] double kinetic_j() const {
        double sum = 0.0;
        for (std::size_t i = 0; i < model.node_count(); ++i) sum += 0.5 * model.mass[i] * state.velocity[i].squaredNorm();
        return sum;
    }
    RodModel model;
    RodState state, start;
    RodDrive drive;
    std::vector<RodPlane> planes;
    std::vector<Vec3> force;
    RodWorkspace work;
    RodReport report;
    Index inside = kNoIndex; // rod before it whose bore it is in
    double play = 0.0;       // m
};

/// Steps as the engine does: a rough look ahead, meetings, solves until all is proven, and what is not held.
class RodsOfATest {
public:
    RodAlone& add(const RodDesign& design, const RodPort& port, double insertion, double friction) {
        rods.push_back(std::make_unique<RodAlone>(design, port, insertion, friction));
        return *rods.back();
    }
    void step(double dt) {
        for (auto& rod : rods) {
            rod->start = rod->state, rod->drive.force = rod->force;
            for (RodPlane& plane : rod->planes) plane.start_force = plane.force, plane.start_drag = plane.drag;
        }
        for (RodMeeting& m : meetings) m.plane.start_force = m.plane.force, m.plane.start_drag = m.plane.drag;
        solve(dt, true);
        around.begin(moved(), dt);
        around.list_planes(moved(), meetings);
        for (rounds = 0; rounds < 4; ++rounds) {
            solve(dt, false);
            const bool settled = std::all_of(rods.begin(), rods.end(), [](const auto& rod) { return rod->report.unconverged == 0; });
            if (around.check(moved(), settled, meetings)) break;
        }
        share = around.find_proven_share(moved());
        if (share >= 1.0) return;
        for (auto& rod : rods)
            for (std::size_t i = 0; i < rod->state.position.size(); ++i) {
                rod->state.position[i] = rod->start.position[i] + 0.9 * share * (rod->state.position[i] - rod->start.position[i]);
                rod->state.velocity[i] *= 0.9 * share;
            }
        for (RodMeeting& m : meetings) m.plane.force = 0.0, m.plane.drag.setZero();
    }
    /// What has come out of its port, the segment in it included.
    [[nodiscard]] std::vector<Vec3> outside(std::size_t r) const {
        const Index first = first_inserted_node(rods[r]->model, rods[r]->state.insertion);
        return {rods[r]->state.position.begin() + (first > 0 ? first - 1 : 0), rods[r]->state.position.end()};
    }
    [[nodiscard]] double nearest() const { // sums of radii
        double least = 10.0;
        for (std::size_t a = 0; a < rods.size(); ++a)
            for (std::size_t b = a + 1; b < rods.size(); ++b) {
                const std::vector<Vec3> x = outside(a), y = outside(b);
                for (std::size_t i = 0; i + 1 < x.size(); ++i)
                    for (std::size_t j = 0; j + 1 < y.size(); ++j)
                        least = std::min(least, distance_by_search(x[i], x[i + 1], y[j], y[j + 1]) /
                                                    (rods[a]->model.design.radius + rods[b]->model.design.radius));
            }
        return least;
    }
    [[nodiscard]] std::size_t pressing() const {
        return static_cast<std::size_t>(std::count_if(meetings.begin(), meetings.end(), [](const RodMeeting& m) { return m.plane.force > 0.0; }));
    }

    std::vector<std::unique_ptr<RodAlone>> rods;
    std::vector<RodMeeting> meetings;
    RodMeetings around;
    unsigned rounds = 0;
    double share = 1.0;

private:
    void solve(double dt, bool rough) {
        std::vector<SolvedRod> all;
        for (auto& rod : rods) {
            rod->state = rod->start, rod->drive.rough = rough;
            for (RodPlane& plane : rod->planes) plane.force = plane.start_force, plane.drag = plane.start_drag;
            all.push_back({rod->model, rod->state, rod->drive, rod->planes, rod->work, rod->report, {}, static_cast<Index>(all.size())});
        }
        for (RodMeeting& m : meetings) m.plane.force = m.plane.start_force, m.plane.drag = m.plane.start_drag;
        solve_together(all, meetings, dt, work_);
    }
    [[nodiscard]] std::span<const MovedRod> moved() {
        list_.clear();
        for (auto& rod : rods)
            list_.push_back({static_cast<Index>(list_.size()), 0, &rod->model, rod->start.position, rod->state.position,
                             first_inserted_node(rod->model, rod->state.insertion), rod->state.insertion, rod->inside, rod->play});
        return list_;
    }
    std::vector<MovedRod> list_;
    TogetherWorkspace work_;
};

} // namespace trocar::fem
