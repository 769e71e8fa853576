#include "bench/contact_workloads.hpp"

#include "assets/anatomy/vessel_field.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace trocar::engine {
namespace {

constexpr double kPi = std::numbers::pi;

// --- cloth

constexpr double kSquare = 0.01;        // m
constexpr double kPleat = 20 * kSquare; // m, from fold to fold

/// Angle of the pleats' profile at arc length s: flat in the middle of a pleat, turning at its ends.
double profile_angle(double s, double steepest) { return steepest * std::tanh(6.0 * std::sin(kPi * s / kPleat)) / std::tanh(6.0); }

double wrinkle(double u, double s, double phase) {
    return std::sin(2 * kPi * u / 0.13 + 7 * s + 0.11 * phase) + 0.7 * std::sin(2 * kPi * s / 0.083 + 11 * u - 0.1 * phase) +
           0.5 * std::sin(2 * kPi * (u + s) / 0.047 + 0.08 * phase);
}

void add_cloth_frame(std::size_t columns, std::size_t rows, double share, double phase, std::vector<Vec3>& out) {
    const double opened = (1 - share) * (1 - share), steepest = (60 + 34.5 * (1 - opened * opened)) * kPi / 180;
    const double height = 0.0016 * (0.25 + 0.75 * share);
    constexpr int kParts = 16; // of a square, along the profile
    double x = 0.0, z = 0.0;
    for (std::size_t j = 0; j <= rows; ++j) {
        const double s = kSquare * static_cast<double>(j), angle = profile_angle(s, steepest);
        const Vec3 base(x, 0.0, z), normal(-std::sin(angle), 0.0, std::cos(angle));
        for (std::size_t i = 0; i <= columns; ++i) {
            const double u = kSquare * static_cast<double>(i);
            Vec3 p = base + height * wrinkle(u, s, phase) * normal;
            p[1] = u + 0.004 * std::sin(2 * kPi * s / 0.4 + 0.05 * phase);
            const double turn = 0.2 + 0.25 * share * std::sin(p[1] - 0.5); // so that nothing stays along an axis
            out.emplace_back(std::cos(turn) * p[0] - std::sin(turn) * p[2], p[1], std::sin(turn) * p[0] + std::cos(turn) * p[2]);
        }
        for (int k = 0; k < kParts; ++k) {
            const double part = profile_angle(s + kSquare * (k + 0.5) / kParts, steepest);
            x += std::cos(part) * kSquare / kParts;
            z += std::sin(part) * kSquare / kParts;
        }
    }
}

void add_square(Index a, Index b, Index c, Index d, bool other_diagonal, std::vector<Triangle>& out) {
    if (other_diagonal) {
        out.push_back({a, b, c});
        out.push_back({a, c, d});
    } else {
        out.push_back({a, b, d});
        out.push_back({b, c, d});
    }
}

// --- artery

Vec3 bezier(const std::array<Vec3, 4>& p, double t) {
    const double u = 1 - t;
    return u * u * u * p[0] + 3 * u * u * t * p[1] + 3 * u * t * t * p[2] + t * t * t * p[3];
}

anatomy::Tube make_tube(const std::array<Vec3, 4>& axis, double from, double to, bool root) {
    anatomy::Tube tube;
    constexpr int kPoints = 160;
    for (int i = 0; i <= kPoints; ++i) {
        const double t = static_cast<double>(i) / kPoints;
        tube.points.push_back(bezier(axis, t));
        tube.radii.push_back(from + (to - from) * t);
    }
    if (root) return tube;
    tube.blend = 0.003;
    tube.blend_begin = 0.012;
    tube.blend_end = 0.02;
    return tube;
}

const std::array<Vec3, 4> kTrunk{Vec3(0, 0, -0.01), Vec3(0.005, 0, 0.04), Vec3(-0.006, 0.005, 0.08), Vec3(0, 0, 0.12)};
const std::array<Vec3, 4> kBranch{Vec3(0, 0, 0.12), Vec3(0.006, -0.003, 0.142), Vec3(0.028, 0.008, 0.162), Vec3(0.04, 0.006, 0.198)};

std::vector<anatomy::Tube> artery_tubes() {
    const auto branch_from = [](const Vec3& root, const Vec3& a, const Vec3& b, const Vec3& c) {
        return std::array<Vec3, 4>{root, root + a, root + b, root + c};
    };
    std::vector<anatomy::Tube> tubes;
    tubes.push_back(make_tube(kTrunk, 0.0070, 0.0055, true));
    tubes.push_back(make_tube(kBranch, 0.0046, 0.0032, false));
    tubes.push_back(
        make_tube(branch_from(kTrunk[3], {-0.006, -0.002, 0.02}, {-0.026, -0.01, 0.04}, {-0.036, -0.004, 0.07}), 0.0044, 0.0030, false));
    tubes.push_back(make_tube(branch_from(bezier(kTrunk, 0.5), {-0.014, 0.004, 0.008}, {-0.024, 0.008, 0.024}, {-0.03, 0.014, 0.048}),
                              0.0036, 0.0024, false));
    tubes.push_back(make_tube(branch_from(bezier(kTrunk, 0.72), {0.004, 0.014, 0.008}, {0.006, 0.024, 0.024}, {0.01, 0.03, 0.044}), 0.0034,
                              0.0022, false));
    tubes.push_back(make_tube(branch_from(bezier(kBranch, 0.55), {0.002, -0.01, 0.008}, {0.008, -0.018, 0.018}, {0.016, -0.024, 0.034}),
                              0.0026, 0.0018, false));
    return tubes;
}

/// Surface nets: a vertex per cell that the surface crosses, a square per edge of the grid that it crosses.
/// source   Gibson, "Constrained elastic surface nets" (1998), without the elastic part
class SurfaceNet {
public:
    SurfaceNet(const anatomy::Field& field, const Box3& box, double cell) : field_(field), lo_(box.lo), cell_(cell) {
        for (int axis = 0; axis < 3; ++axis) size_[axis] = static_cast<std::int64_t>(std::ceil((box.hi[axis] - box.lo[axis]) / cell)) + 1;
        sample();
        for (std::int64_t z = 1; z + 1 < size_[2]; ++z)
            for (std::int64_t y = 1; y + 1 < size_[1]; ++y)
                for (std::int64_t x = 1; x + 1 < size_[0]; ++x)
                    for (int axis = 0; axis < 3; ++axis) add_edge({x, y, z}, axis);
    }
    std::vector<Vec3> vertices;
    std::vector<Triangle> triangles;

private:
    using Place = std::array<std::int64_t, 3>;

    std::size_t id(const Place& p) const { return static_cast<std::size_t>((p[2] * size_[1] + p[1]) * size_[0] + p[0]); }
    Vec3 point(const Place& p) const {
        return lo_ + cell_ * Vec3(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
    }

    /// Blocks far from the surface are given one value.
    void sample() {
        constexpr std::int64_t kBlock = 4;
        values_.assign(static_cast<std::size_t>(size_[0] * size_[1] * size_[2]), 1.0f);
        for (std::int64_t z = 0; z < size_[2]; z += kBlock)
            for (std::int64_t y = 0; y < size_[1]; y += kBlock)
                for (std::int64_t x = 0; x < size_[0]; x += kBlock) {
                    const double middle = field_.value(point({x + kBlock / 2, y + kBlock / 2, z + kBlock / 2}));
                    const bool far = std::abs(middle) > 2.0 * kBlock * cell_;
                    for (std::int64_t c = z; c < std::min(z + kBlock, size_[2]); ++c)
                        for (std::int64_t b = y; b < std::min(y + kBlock, size_[1]); ++b)
                            for (std::int64_t a = x; a < std::min(x + kBlock, size_[0]); ++a)
                                values_[id({a, b, c})] = static_cast<float>(far ? middle : field_.value(point({a, b, c})));
                }
    }

    /// In the middle of where the cell's edges are crossed, then drawn to the surface.
    Index vertex_of(const Place& cell) {
        const auto [entry, is_new] = of_cell_.try_emplace(id(cell), static_cast<Index>(vertices.size()));
        if (!is_new) return entry->second;
        Vec3 sum = Vec3::Zero();
        int count = 0;
        for (int axis = 0; axis < 3; ++axis)
            for (int corner = 0; corner < 4; ++corner) {
                Place a = cell;
                a[static_cast<std::size_t>((axis + 1) % 3)] += corner & 1;
                a[static_cast<std::size_t>((axis + 2) % 3)] += corner >> 1;
                Place b = a;
                b[static_cast<std::size_t>(axis)] += 1;
                const double from = values_[id(a)], to = values_[id(b)];
                if ((from < 0) == (to < 0)) continue;
                sum += point(a) + from / (from - to) * (point(b) - point(a));
                ++count;
            }
        Vec3 p = sum / count;
        for (int round = 0; round < 2; ++round) {
            const Vec3 slope = field_.gradient(p);
            if (slope.squaredNorm() > 0.1) p -= 0.7 * field_.value(p) / slope.squaredNorm() * slope;
        }
        vertices.push_back(p);
        return entry->second;
    }

    void add_edge(const Place& from, int axis) {
        Place to = from;
        to[static_cast<std::size_t>(axis)] += 1;
        const bool inside = values_[id(from)] < 0;
        if (inside == (values_[id(to)] < 0)) return;
        const auto cell = [&](int i, int k) {
            Place c = from;
            c[static_cast<std::size_t>((axis + 1) % 3)] -= i;
            c[static_cast<std::size_t>((axis + 2) % 3)] -= k;
            return vertex_of(c);
        };
        std::array<Index, 4> q{cell(1, 1), cell(0, 1), cell(0, 0), cell(1, 0)};
        if (!inside) std::swap(q[1], q[3]);
        const double one = (vertices[q[0]] - vertices[q[2]]).squaredNorm(), other = (vertices[q[1]] - vertices[q[3]]).squaredNorm();
        add_square(q[0], q[1], q[2], q[3], one < other, triangles);
    }

    const anatomy::Field& field_;
    Vec3 lo_;
    double cell_;
    Place size_{};
    std::vector<float> values_;
    std::map<std::size_t, Index> of_cell_;
};

/// Bends more the farther from the inlet, and sways.
Vec3 bend(const Vec3& p, double frame) {
    const double w = 2 * kPi * frame / 60, along = std::max(0.0, p[2]) / 0.2;
    const double ax = 0.03 * std::sin(w) * along, ay = 0.02 * std::sin(0.7 * w + 0.4) * along;
    const Vec3 a(p[0] * std::cos(ax) + p[2] * std::sin(ax), p[1], -p[0] * std::sin(ax) + p[2] * std::cos(ax));
    const Vec3 b(a[0], a[1] * std::cos(ay) - a[2] * std::sin(ay), a[1] * std::sin(ay) + a[2] * std::cos(ay));
    const double sway = 0.15e-3 * std::sin(1.3 * w + 50 * p[2]);
    return b + Vec3(sway, 0.5 * sway, 0.0);
}

constexpr std::size_t kRings = 251, kSides = 20; // of the catheter: 250 x 20 squares
constexpr double kRadius = 0.9e-3;               // m
constexpr double kRingSpacing = 0.6e-3;          // m
constexpr double kPush = 0.75e-3;                // m per step

/// The way of the catheter: trunk, then branch, smoothed, with the clearance between axis and wall along a direction that turns slowly.
class Guide {
public:
    explicit Guide(const anatomy::Field& field) {
        for (int i = 0; i <= 240; ++i) axis_.push_back(bezier(kTrunk, i / 240.0));
        for (int i = 1; i <= 200; ++i) axis_.push_back(bezier(kBranch, i / 200.0));
        const Vec3 inlet = (axis_[1] - axis_[0]).normalized(), first = axis_[0];
        for (int i = 1; i <= 160; ++i) axis_.insert(axis_.begin(), first - 0.5e-3 * i * inlet);
        for (int round = 0; round < 150; ++round)
            for (std::size_t i = 1; i + 1 < axis_.size(); ++i) axis_[i] = 0.5 * axis_[i] + 0.25 * (axis_[i - 1] + axis_[i + 1]);
        resample();
        for (std::size_t i = 0; i < axis_.size(); ++i) {
            const Vec3 tangent = (axis_[std::min(i + 1, axis_.size() - 1)] - axis_[i == 0 ? 0 : i - 1]).normalized();
            const double turn = 0.012 * static_cast<double>(i);
            Vec3 side(std::cos(turn), std::sin(turn), 0.1);
            side = (side - side.dot(tangent) * tangent).normalized();
            sides_.push_back(side);
            double room = 0.0;
            const bool outside = axis_[i][2] < -0.006;
            while (!outside && room < 0.012 && field.value(axis_[i] + room * side) < -kRadius) room += 0.02e-3;
            clearances_.push_back(outside ? 6e-3 : room);
        }
        for (int round = 0; round < 200; ++round)
            for (std::size_t i = 1; i + 1 < clearances_.size(); ++i) clearances_[i] = 0.5 * clearances_[i] + 0.25 * (clearances_[i - 1] + clearances_[i + 1]);
    }

    /// m along the way, frame; where the catheter's axis lies. Its clearance swings, and is negative in places.
    Vec3 at(double along, double frame) const {
        const double place = std::clamp(along / kSpacing, 0.0, static_cast<double>(axis_.size() - 2));
        const auto i = static_cast<std::size_t>(place);
        const double share = place - static_cast<double>(i);
        const auto point = [&](std::size_t k) {
            const double s = 1e3 * kSpacing * static_cast<double>(k);
            const double clearance = 1e-3 * (0.10 + 0.16 * std::sin(0.11 * s + 0.35 * frame) + 0.08 * std::sin(0.31 * s - 0.8 * frame));
            return Vec3(axis_[k] + std::max(0.0, clearances_[k] - clearance) * sides_[k]);
        };
        return (1 - share) * point(i) + share * point(i + 1);
    }

private:
    static constexpr double kSpacing = 0.25e-3; // m

    void resample() {
        std::vector<Vec3> even{axis_[0]};
        double left = kSpacing;
        for (std::size_t i = 1; i < axis_.size(); ++i) {
            const Vec3 way = axis_[i] - axis_[i - 1];
            const double length = way.norm();
            for (; left <= length; left += kSpacing) even.push_back(axis_[i - 1] + left / length * way);
            left -= length;
        }
        axis_ = even;
    }

    std::vector<Vec3> axis_, sides_;
    std::vector<double> clearances_;
};

void add_catheter_frame(const Guide& guide, double frame, std::vector<Vec3>& out) {
    std::vector<Vec3> axis;
    for (std::size_t i = 0; i < kRings; ++i)
        axis.push_back(bend(guide.at(0.03 + kPush * frame + kRingSpacing * static_cast<double>(i), frame), frame));
    for (int round = 0; round < 4; ++round)
        for (std::size_t i = 1; i + 1 < kRings; ++i) axis[i] = 0.5 * axis[i] + 0.25 * (axis[i - 1] + axis[i + 1]);
    Vec3 across = Vec3::UnitX();
    for (std::size_t i = 0; i < kRings; ++i) {
        const Vec3 tangent = (axis[std::min(i + 1, kRings - 1)] - axis[i == 0 ? 0 : i - 1]).normalized();
        across = (across - across.dot(tangent) * tangent).normalized();
        const Vec3 third = tangent.cross(across);
        const double to_tip = static_cast<double>(kRings - 1 - i);
        const double radius = kRadius * (to_tip < 6 ? std::sqrt(std::max(0.02, 1 - (6 - to_tip) * (6 - to_tip) / 38)) : 1.0);
        for (std::size_t k = 0; k < kSides; ++k) {
            const double angle = 2 * kPi * static_cast<double>(k) / kSides + 0.02 * frame;
            out.push_back(axis[i] + radius * (std::cos(angle) * across + std::sin(angle) * third));
        }
    }
}

} // namespace

FrameSequence make_folding_cloth(std::size_t columns, std::size_t rows, const FoldPart& part) {
    FrameSequence out;
    out.name = "cloth";
    out.frame_count = part.steps + 1;
    out.objects.assign((columns + 1) * (rows + 1), 0);
    const auto id = [&](std::size_t i, std::size_t j) { return static_cast<Index>(j * (columns + 1) + i); };
    for (std::size_t j = 0; j < rows; ++j)
        for (std::size_t i = 0; i < columns; ++i)
            add_square(id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1), (i + j) % 2 == 1, out.triangles);
    for (std::size_t k = part.first; k <= part.first + part.steps; ++k)
        add_cloth_frame(columns, rows, static_cast<double>(k) / kFoldSteps, static_cast<double>(k), out.positions);
    return out;
}

FrameSequence make_bending_artery(double cell, std::size_t steps) {
    const anatomy::VesselField field(artery_tubes());
    Box3 box = field.box();
    box.inflate(3 * cell);
    box.lo[2] = 0.0; // open at the inlet
    const SurfaceNet net(field, box, cell);
    FrameSequence out;
    out.name = "artery";
    out.frame_count = steps + 1;
    out.triangles = net.triangles;
    out.objects.assign(net.vertices.size(), 0);
    const auto first = static_cast<Index>(net.vertices.size());
    out.objects.resize(first + kRings * kSides, 1);
    for (Index i = 0; i + 1 < kRings; ++i)
        for (Index k = 0; k < kSides; ++k) {
            const Index next = (k + 1) % kSides, a = first + i * kSides + k, b = first + i * kSides + next;
            add_square(a, b, b + kSides, a + kSides, (i + k) % 2 == 1, out.triangles);
        }
    const Guide guide(field);
    for (std::size_t k = 0; k <= steps; ++k) {
        const auto frame = static_cast<double>(k);
        for (const Vec3& p : net.vertices) out.positions.push_back(bend(p, frame));
        add_catheter_frame(guide, frame, out.positions);
    }
    return out;
}

} // namespace trocar::engine
