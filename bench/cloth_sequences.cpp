#include "bench/cloth_sequences.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace trocar::engine {
namespace {

constexpr double kHalfTurn = std::numbers::pi;
constexpr double kStep = 1.0 / 240.0; // s
constexpr double kGravity = 9.81;     // m/s^2
constexpr int kSweeps = 12;           // over all threads of the cloth, each step
constexpr double kFriction = 0.4;     // share of the sliding that a touch takes away

/// A solid of revolution about z, or several: in its own frame, and where that frame is at a time.
struct Solid {
    std::vector<Vec3> rest;
    std::vector<Triangle> triangles;
};

/// Rings about the z axis; profile(0 .. 1) gives radius and height.
template <class Profile>
void add_revolution(std::size_t rings, std::size_t sides, const Vec3& centre, const Profile& profile, Solid& out) {
    const auto first = static_cast<Index>(out.rest.size()), n = static_cast<Index>(sides);
    for (std::size_t i = 0; i <= rings; ++i) {
        const auto [radius, height] = profile(static_cast<double>(i) / static_cast<double>(rings));
        for (std::size_t k = 0; k < sides; ++k) {
            const double angle = 2.0 * kHalfTurn * (static_cast<double>(k) + 0.5 * static_cast<double>(i % 2)) / static_cast<double>(sides);
            out.rest.push_back(centre + Vec3(radius * std::cos(angle), radius * std::sin(angle), height));
        }
    }
    for (Index i = 0; i < rings; ++i)
        for (Index k = 0; k < n; ++k) {
            const Index a = first + i * n + k, b = first + i * n + (k + 1) % n;
            out.triangles.push_back({a, b, a + n});
            out.triangles.push_back({b, b + n, a + n});
        }
}

constexpr double kBallRadius = 0.25;                     // m
constexpr double kConeRadius = 0.16, kConeHeight = 0.35; // m
constexpr double kBodyRadius = 0.16, kBodyHeight = 0.9;  // m
constexpr std::array<std::array<double, 2>, 4> kConePlaces{{{0.25, 0.25}, {-0.25, 0.25}, {-0.25, -0.25}, {0.25, -0.25}}};

/// The cloth is held on a surface a little inside the solid's mesh, as a thin contact layer leaves it: so they do touch.
constexpr double kSink = 0.998;

double body_radius(double height) noexcept { return kBodyRadius * (1.0 + 0.25 * std::cos(7.0 * height)); }

/// Threads between grid points, and weights: 0 holds a point.
struct Cloth {
    std::vector<Vec3> at, before;
    std::vector<double> inverse_mass;
    std::vector<Triangle> triangles;
    struct Thread {
        Index a, b;
        double length;
    };
    std::vector<Thread> threads;
};

/// A grid whose places the caller gives; closed: the last column is sewn to the first.
template <class Place>
Cloth make_cloth(std::size_t columns, std::size_t rows, bool closed, const Place& place) {
    Cloth cloth;
    const std::size_t across = closed ? columns : columns + 1;
    const auto id = [&](std::size_t i, std::size_t j) { return static_cast<Index>(j * across + i % across); };
    for (std::size_t j = 0; j <= rows; ++j)
        for (std::size_t i = 0; i < across; ++i)
            cloth.at.push_back(
                place(static_cast<double>(i) / static_cast<double>(columns), static_cast<double>(j) / static_cast<double>(rows)));
    const auto tie = [&](Index a, Index b) { cloth.threads.push_back({a, b, (cloth.at[a] - cloth.at[b]).norm()}); };
    for (std::size_t j = 0; j <= rows; ++j)
        for (std::size_t i = 0; i < across; ++i) {
            const bool right = closed || i < columns;
            if (right) tie(id(i, j), id(i + 1, j));
            if (j < rows) tie(id(i, j), id(i, j + 1));
            if (!right || j == rows) continue;
            tie(id(i, j), id(i + 1, j + 1));
            tie(id(i + 1, j), id(i, j + 1));
            cloth.triangles.push_back({id(i, j), id(i + 1, j), id(i, j + 1)});
            cloth.triangles.push_back({id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)});
        }
    cloth.before = cloth.at;
    cloth.inverse_mass.assign(cloth.at.size(), 1.0);
    return cloth;
}

/// The solid's motion, and how it keeps a point out of it.
struct MovedScene {
    ClothScene kind;
    /// Of the solid's frame at a time.
    [[nodiscard]] Vec3 place(double t) const noexcept {
        if (kind == ClothScene::BallCloth) return {0.0, 0.9 - 1.2 * t, 0.0};
        if (kind == ClothScene::Garment) return {0.06 * std::sin(5.0 * t), 0.03 * std::sin(3.0 * t), 0.0};
        return Vec3::Zero();
    }
    [[nodiscard]] double turn(double t) const noexcept {
        if (kind == ClothScene::SpinningBall) return 2.5 * t;
        if (kind == ClothScene::Garment) return 0.8 * std::sin(4.0 * t);
        return 0.0;
    }
    [[nodiscard]] Vec3 to_world(const Vec3& p, double t) const noexcept {
        const double c = std::cos(turn(t)), s = std::sin(turn(t));
        return place(t) + Vec3(c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]);
    }
    [[nodiscard]] Vec3 to_solid(const Vec3& p, double t) const noexcept {
        const double c = std::cos(turn(t)), s = std::sin(turn(t));
        const Vec3 q = p - place(t);
        return {c * q[0] + s * q[1], -s * q[0] + c * q[1], q[2]};
    }
    /// A point of the solid's frame, moved out of it.
    [[nodiscard]] Vec3 out_of(const Vec3& p) const noexcept {
        if (kind == ClothScene::FourCones) return out_of_cones(p);
        if (kind == ClothScene::Garment) {
            const double along = std::sqrt(p[0] * p[0] + p[1] * p[1]), radius = kSink * body_radius(p[2]);
            return along >= radius || !(along > 0.0) ? p : Vec3(p[0] * radius / along, p[1] * radius / along, p[2]);
        }
        const double distance = p.norm();
        return distance >= kSink * kBallRadius || !(distance > 0.0) ? p : Vec3(p * (kSink * kBallRadius / distance));
    }
    [[nodiscard]] static Vec3 out_of_cones(Vec3 p) noexcept {
        const double slope = kConeRadius / kConeHeight, normal = 1.0 / std::sqrt(1.0 + slope * slope);
        for (const auto& c : kConePlaces) {
            const double x = p[0] - c[0], y = p[1] - c[1], along = std::sqrt(x * x + y * y);
            const double inside = (slope * (kConeHeight - p[2]) - along) * normal;
            if (!(inside > 0.0 && p[2] > 0.0)) continue;
            const double share = along > 1e-12 ? inside * normal / along : 0.0;
            p += Vec3(share * x, share * y, inside * slope * normal);
        }
        if (p[2] < 0.0) p[2] = 0.0; // the floor
        return p;
    }
};

void pull_threads(Cloth& cloth) {
    for (const Cloth::Thread& thread : cloth.threads) {
        const double wa = cloth.inverse_mass[thread.a], wb = cloth.inverse_mass[thread.b];
        const Vec3 way = cloth.at[thread.b] - cloth.at[thread.a];
        const double length = way.norm();
        if (wa + wb == 0.0 || !(length > 0.0)) continue;
        const Vec3 pull = (length - thread.length) / (length * (wa + wb)) * way;
        cloth.at[thread.a] += wa * pull;
        cloth.at[thread.b] -= wb * pull;
    }
}

void step(const MovedScene& scene, double t, Cloth& cloth) {
    std::vector<Vec3> start = cloth.at;
    for (std::size_t v = 0; v < cloth.at.size(); ++v) {
        if (cloth.inverse_mass[v] == 0.0) continue;
        cloth.at[v] += 0.995 * (cloth.at[v] - cloth.before[v]) - Vec3(0.0, 0.0, kGravity * kStep * kStep);
    }
    for (int sweep = 0; sweep < kSweeps; ++sweep) pull_threads(cloth);
    for (std::size_t v = 0; v < cloth.at.size(); ++v) {
        if (cloth.inverse_mass[v] == 0.0) continue;
        const Vec3 p = scene.to_solid(cloth.at[v], t + kStep), out = scene.out_of(p);
        if (out == p) continue;
        const Vec3 carried = scene.to_solid(start[v], t); // where the solid would carry it
        cloth.at[v] = scene.to_world(scene.out_of((1.0 - kFriction) * out + kFriction * carried), t + kStep);
    }
    cloth.before = std::move(start);
}

Solid make_solid(ClothScene scene, std::size_t triangles) {
    Solid solid;
    const auto squares = static_cast<double>(triangles) / 2.0;
    const auto ball = [](double s) {
        return std::pair(kBallRadius * std::sin(kHalfTurn * (0.002 + 0.996 * s)), -kBallRadius * std::cos(kHalfTurn * s));
    };
    if (scene == ClothScene::FourCones) {
        const auto sides = static_cast<std::size_t>(std::max(6.0, std::sqrt(squares)));
        const std::size_t rings = std::max<std::size_t>(1, static_cast<std::size_t>(squares / 4.0) / sides);
        for (const auto& c : kConePlaces)
            add_revolution(
                rings, sides, {c[0], c[1], 0.0}, [](double s) { return std::pair(kConeRadius * (1.0 - 0.998 * s), kConeHeight * s); },
                solid);
        return solid;
    }
    const auto rings = static_cast<std::size_t>(std::max(4.0, std::sqrt(squares))),
               sides = std::max<std::size_t>(6, static_cast<std::size_t>(squares) / rings);
    if (scene == ClothScene::Garment)
        add_revolution(
            rings, sides, Vec3::Zero(), [](double s) { return std::pair(body_radius(kBodyHeight * (s - 0.8)), kBodyHeight * (s - 0.8)); },
            solid);
    else
        add_revolution(rings, sides, Vec3::Zero(), ball, solid);
    return solid;
}

Cloth make_cloth_of(ClothScene scene, std::size_t triangles) {
    const auto side = static_cast<std::size_t>(std::max(4.0, std::sqrt(static_cast<double>(triangles) / 2.0)));
    const auto ripple = [](double x, double y) { return 0.002 * std::sin(23.0 * x + 9.0 * y) + 0.001 * std::sin(31.0 * y - 17.0 * x); };
    if (scene == ClothScene::Garment) {
        Cloth skirt = make_cloth(side * 2, side / 2, true, [&](double s, double r) {
            const double angle = 2.0 * kHalfTurn * s, height = 0.05 - 0.5 * r;
            const double radius = body_radius(0.05) + 0.004 + 0.1 * r + 0.02 * r * std::sin(9.0 * angle);
            return Vec3(radius * std::cos(angle), radius * std::sin(angle), height);
        });
        for (std::size_t i = 0; i < side * 2; ++i) skirt.inverse_mass[i] = 0.0; // the waistband goes with the body
        return skirt;
    }
    if (scene == ClothScene::BallCloth) {
        Cloth curtain =
            make_cloth(side, side, false, [&](double s, double r) { return Vec3(1.2 * (s - 0.5), ripple(s, r), 0.55 - 1.2 * r); });
        for (std::size_t i = 0; i <= side; ++i) curtain.inverse_mass[i] = 0.0; // hangs from its upper edge
        return curtain;
    }
    const double height = scene == ClothScene::FourCones ? kConeHeight + 0.01 : kBallRadius + 0.01;
    return make_cloth(side, side, false, [&](double s, double r) { return Vec3(1.1 * (s - 0.5), 1.1 * (r - 0.5), height + ripple(s, r)); });
}

/// Steps before the record begins: the cloth has come down by then, or the ball has come to it.
std::size_t warm_up(ClothScene scene) noexcept { return scene == ClothScene::BallCloth ? 140 : scene == ClothScene::Garment ? 60 : 80; }

} // namespace

ClothSequence make_cloth_sequence(ClothScene kind, std::size_t rigid, std::size_t cloth_triangles, std::size_t steps) {
    const MovedScene scene{kind};
    const Solid solid = make_solid(kind, rigid);
    Cloth cloth = make_cloth_of(kind, cloth_triangles);
    const std::vector<Vec3> rest = cloth.at;
    ClothSequence out;
    out.triangles[0] = solid.triangles;
    out.triangles[1] = cloth.triangles;
    const std::size_t first = warm_up(kind);
    for (std::size_t k = 0; k <= first + steps; ++k) {
        const double t = kStep * static_cast<double>(k);
        if (k > 0) step(scene, t - kStep, cloth);
        if (kind == ClothScene::Garment)
            for (std::size_t v = 0; v < cloth.at.size(); ++v)
                if (cloth.inverse_mass[v] == 0.0) cloth.at[v] = scene.to_world(rest[v], t);
        if (k < first) continue;
        out.frames[0].emplace_back();
        for (const Vec3& p : solid.rest) out.frames[0].back().push_back(scene.to_world(p, t));
        out.frames[1].push_back(cloth.at);
    }
    return out;
}

} // namespace trocar::engine
