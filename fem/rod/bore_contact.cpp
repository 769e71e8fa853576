#include "fem/rod/bore_contact.hpp"

#include "fem/rod/rod.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

/// What a limit goes on with is known by: RodPlane::side.
enum class BorePlace : std::uint8_t { InnerNode, OuterNode, Mouth, InnerTip };

/// [-] of the shorter segment: nodes nearer than this to the mouth leave the load to it, which they pass.
constexpr double kMouthShare = 0.5;
/// Chords that the nearest point is sought along, from where the arc lengths agree.
constexpr Index kSoughtChords = 8;

struct NodePlace {
    Index node;
    double weight;
};
/// A node as a place between two.
NodePlace place_of_node(const MovedRod& rod, Index node) noexcept {
    return node + 1 < rod.model->node_count() ? NodePlace{node, 0.0} : NodePlace{node - 1, 1.0};
}

double arc_at(const MovedRod& rod, double place) noexcept { return arc_of(*rod.model, rod.insertion, place); }

/// The chord at this arc length from the port.
Index chord_at(const MovedRod& rod, double arc) noexcept {
    const double last = static_cast<double>(rod.model->node_count() - 1), place = last - (rod.insertion - arc) / rod.model->segment;
    return static_cast<Index>(std::clamp(place, 0.0, last - 1.0));
}

struct OnChord {
    double weight, apart_sq;
};
OnChord nearest_on_chord(std::span<const Vec3> axis, Index chord, const Vec3& place) noexcept {
    const Vec3 edge = axis[chord + 1] - axis[chord], from = place - axis[chord];
    const double length_sq = edge.squaredNorm(), weight = length_sq > 0.0 ? std::clamp(edge.dot(from) / length_sq, 0.0, 1.0) : 0.0;
    return {weight, (from - weight * edge).squaredNorm()};
}

Vec3 on_chord(std::span<const Vec3> axis, Index node, double weight) noexcept { return (1.0 - weight) * axis[node] + weight * axis[node + 1]; }

/// m, the curve's derivative at a node by its parameter.
Vec3 slope_at(std::span<const Vec3> axis, Index node) noexcept {
    const Index before = node > 0 ? node - 1 : 0, after = std::min<Index>(node + 1, static_cast<Index>(axis.size() - 1));
    return (axis[after] - axis[before]) / static_cast<double>(after - before);
}

/// Limits of one pair.
class BoreLister {
public:
    BoreLister(const MovedRod& outer, const MovedRod& inner, std::span<const RodMeeting> last, std::vector<RodMeeting>& meetings) noexcept
        : outer_(outer), inner_(inner), last_(last), meetings_(meetings) {}

    void list() {
        const std::size_t begin = meetings_.size();
        const double reach = std::min(inner_.insertion, outer_.insertion);
        const double end = reach - kMouthShare * std::min(inner_.model->segment, outer_.model->segment);
        if (inner_.model->segment <= outer_.model->segment) {
            for (Index i = first_of(inner_); i < inner_.model->node_count() && arc_at(inner_, i) < end; ++i) add_inner(i, BorePlace::InnerNode);
        } else {
            for (Index i = first_of(outer_); i < outer_.model->node_count() && arc_at(outer_, i) < end; ++i) add_outer(i, BorePlace::OuterNode);
        }
        if (!(reach > 0.0)) return;
        if (inner_.insertion > outer_.insertion)
            add_outer(static_cast<Index>(outer_.model->node_count() - 1), BorePlace::Mouth);
        else
            add_inner(static_cast<Index>(inner_.model->node_count() - 1), BorePlace::InnerTip);
        hand_on_rest(begin, end);
    }

private:
    static Index first_of(const MovedRod& rod) noexcept { return first_inserted_node(*rod.model, rod.insertion); }

    void add_inner(Index node, BorePlace what) {
        const CurvePoint at = find_on_curve(outer_.to, inner_.to[node], chord_at(outer_, arc_at(inner_, node)));
        const NodePlace own = place_of_node(inner_, node);
        add(own, {at.node, at.weight}, at, -at.beside, what);
    }
    void add_outer(Index node, BorePlace what) {
        const CurvePoint at = find_on_curve(inner_.to, outer_.to[node], chord_at(inner_, arc_at(outer_, node)));
        const NodePlace own = place_of_node(outer_, node);
        add({at.node, at.weight}, own, at, at.beside, what);
    }
    void add(const NodePlace& in, const NodePlace& out, const CurvePoint& at, const Vec3& beside, BorePlace what) {
        RodMeeting meeting;
        meeting.rod = inner_.id, meeting.other_rod = outer_.id;
        meeting.play = inner_.play, meeting.along = at.along, meeting.beside = beside;
        meeting.plane.node = in.node, meeting.plane.weight = in.weight;
        meeting.plane.other = out.node, meeting.plane.other_weight = out.weight;
        meeting.plane.offset = -inner_.play;
        meeting.plane.side = static_cast<std::uint8_t>(what);
        meeting.plane.normal = across(at.along);
        hand_on(meeting);
        turn_to_axis(meeting);
        meetings_.push_back(meeting);
    }
    /// Where the step starts away from the axis its side is known.
    void turn_to_axis(RodMeeting& meeting) const noexcept {
        RodPlane& plane = meeting.plane;
        Vec3 apart = on_chord(inner_.from, plane.node, plane.weight) - on_chord(outer_.from, plane.other, plane.other_weight) + meeting.beside;
        apart -= meeting.along.dot(apart) * meeting.along;
        const double aside = std::sqrt(apart.squaredNorm());
        if (aside > kLeastAside * meeting.play) plane.normal = -apart / aside;
    }
    /// Any direction across this one.
    static Vec3 across(const Vec3& along) noexcept {
        const Vec3 other = std::abs(along.x()) < 0.5 ? Vec3::UnitX() : Vec3::UnitY();
        const Vec3 normal = along.cross(other);
        const double length = std::sqrt(normal.squaredNorm());
        return length > 0.0 ? Vec3(normal / length) : Vec3(Vec3::UnitX());
    }

    [[nodiscard]] bool is_of_pair(const RodMeeting& old) const noexcept { return old.play > 0.0 && old.rod == inner_.id && old.other_rod == outer_.id; }
    /// A place is the same as before by its node; the mouth and the tip are by themselves.
    [[nodiscard]] static bool is_same_place(const RodPlane& a, const RodPlane& b) noexcept {
        if (a.side != b.side) return false;
        if (a.side == static_cast<std::uint8_t>(BorePlace::InnerNode)) return a.node == b.node && a.weight == b.weight;
        if (a.side == static_cast<std::uint8_t>(BorePlace::OuterNode)) return a.other == b.other && a.other_weight == b.other_weight;
        return true;
    }
    /// Was it a place that has come to the mouth, or the tip, since? Others went back behind the port.
    [[nodiscard]] bool is_at_end(const RodPlane& old, double end) const noexcept {
        if (old.side == static_cast<std::uint8_t>(BorePlace::InnerNode)) return arc_at(inner_, old.node + old.weight) >= end;
        if (old.side == static_cast<std::uint8_t>(BorePlace::OuterNode)) return arc_at(outer_, old.other + old.other_weight) >= end;
        return true;
    }
    /// What has passed the mouth, or has become the tip, leaves its load there.
    void hand_on_rest(std::size_t begin, double end_arc) const noexcept {
        const std::span<RodMeeting> listed = std::span(meetings_).subspan(begin);
        Vec3 force = Vec3::Zero(), drag = Vec3::Zero();
        bool left = false;
        for (const RodMeeting& old : last_) {
            if (!is_of_pair(old) || !is_at_end(old.plane, end_arc)) continue;
            if (std::any_of(listed.begin(), listed.end(), [&](const RodMeeting& m) { return is_same_place(m.plane, old.plane); })) continue;
            left = true;
            force += old.plane.start_force * old.plane.normal;
            drag += old.plane.start_drag;
        }
        if (!left) return;
        RodPlane& end = listed.back().plane;
        force += end.start_force * end.normal;
        const double length = std::sqrt(force.squaredNorm());
        if (!(length > 0.0)) return;
        end.normal = force / length;
        end.force = end.start_force = length;
        drag += end.start_drag;
        end.drag = end.start_drag = drag - end.normal.dot(drag) * end.normal;
    }
    void hand_on(RodMeeting& meeting) const noexcept {
        for (const RodMeeting& old : last_) {
            if (!is_of_pair(old) || !is_same_place(old.plane, meeting.plane)) continue;
            RodPlane& plane = meeting.plane;
            plane.normal = old.plane.normal;
            plane.force = plane.start_force = old.plane.start_force;
            plane.drag = plane.start_drag = old.plane.start_drag;
            return;
        }
    }

    const MovedRod &outer_, &inner_;
    std::span<const RodMeeting> last_;
    std::vector<RodMeeting>& meetings_;
};

} // namespace

CurvePoint find_on_curve(std::span<const Vec3> axis, const Vec3& place, Index start) noexcept {
    const Index last = static_cast<Index>(axis.size() - 2);
    Index chord = std::min(start, last);
    OnChord best = nearest_on_chord(axis, chord, place);
    for (const int way : {1, -1}) // to where it comes no nearer
        for (Index k = 0; k < kSoughtChords; ++k) {
            if (way < 0 ? chord == 0 : chord == last) break;
            const Index next = way < 0 ? chord - 1 : chord + 1;
            const OnChord there = nearest_on_chord(axis, next, place);
            if (!(there.apart_sq < best.apart_sq)) break;
            chord = next, best = there;
        }
    const double t = best.weight, u = 1.0 - t;
    const Vec3 edge = axis[chord + 1] - axis[chord], from = slope_at(axis, chord) - edge, to = slope_at(axis, chord + 1) - edge;
    CurvePoint point{chord, t, t * u * (u * from - t * to), edge + u * (u - 2.0 * t) * from + t * (t - 2.0 * u) * to};
    const double length = std::sqrt(point.along.squaredNorm());
    point.along = length > 0.0 ? Vec3(point.along / length) : Vec3(Vec3::Zero());
    return point;
}

double find_bore_excess(const RodMeeting& meeting, std::span<const Vec3> inner, std::span<const Vec3> outer) noexcept {
    const RodPlane& plane = meeting.plane;
    const bool by_outer = plane.side == static_cast<std::uint8_t>(BorePlace::OuterNode) || plane.side == static_cast<std::uint8_t>(BorePlace::Mouth);
    const std::span<const Vec3> axis = by_outer ? inner : outer;
    const Vec3 place = by_outer ? on_chord(outer, plane.other, plane.other_weight) : on_chord(inner, plane.node, plane.weight);
    const CurvePoint at = find_on_curve(axis, place, by_outer ? plane.node : plane.other);
    Vec3 apart = place - on_chord(axis, at.node, at.weight) - at.beside;
    apart -= at.along.dot(apart) * at.along;
    return std::max(0.0, std::sqrt(apart.squaredNorm()) - meeting.play);
}

void list_bore(const MovedRod& outer, const MovedRod& inner, std::span<const RodMeeting> last, std::vector<RodMeeting>& meetings) {
    BoreLister(outer, inner, last, meetings).list();
}

} // namespace trocar::fem
