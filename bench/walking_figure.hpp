// A figure of 28,784 faces that walks, and trousers of 1,626 faces worn by it: the scene of table 1 of "Hierarchical techniques in
// collision detection for cloth animation" (Mezger, Kimmerle, Etzmuss 2003), made here, since the paper's avatar is not available. The
// same numbers on every run: the cloth is a deterministic solver of distance constraints, at the paper's step of 0.01 s.
#pragma once

#include "base/mesh.hpp"

#include <array>
#include <span>
#include <vector>

namespace trocar::engine {

/// A leg or an arm: two bones in a plane along the walk, rounded at the joint, round across.
struct Limb {
    Vec3 root = Vec3::Zero();        // m
    double upper = 0.0, lower = 0.0; // m, lengths
    double swing = 0.0, flex = 0.0;  // rad, of the upper bone forwards, of the lower one backwards against it
    std::array<double, 4> radius{};  // m, at root, joint, thickest place of the lower part, end

    [[nodiscard]] double length() const noexcept { return upper + lower; }
    /// On the axis, and the direction of the axis there.
    struct Place {
        Vec3 point, along;
    };
    [[nodiscard]] Place at(double arc) const noexcept; // m from the root
    [[nodiscard]] double radius_at(double arc) const noexcept;
};

/// The pose at a time.
struct FigurePose {
    Vec3 pelvis = Vec3::Zero(); // m, middle of the hips
    std::array<Limb, 2> legs, arms;
};

class WalkingFigure {
public:
    static constexpr double kStep = 0.01;     // s, the paper's
    static constexpr double kStanding = -1.0; // s, until then it stands

    WalkingFigure();
    [[nodiscard]] const std::vector<Triangle>& triangles() const noexcept { return triangles_; }
    [[nodiscard]] std::size_t vertex_count() const noexcept { return vertex_count_; }
    /// time   s; before 0 the figure stands and starts to walk
    [[nodiscard]] static FigurePose pose(double time) noexcept;
    void place_skin(double time, std::vector<Vec3>& skin) const;

private:
    void add_tube(Index rings, Index sides);

    std::vector<Triangle> triangles_;
    std::size_t vertex_count_ = 0;
};

class Trousers {
public:
    /// Worn by the figure as it stands, then hanged on it for the time before 0.
    /// walks   false: it stands all the time
    explicit Trousers(bool walks = true);
    [[nodiscard]] const std::vector<Triangle>& triangles() const noexcept { return triangles_; }
    [[nodiscard]] std::span<const Vec3> positions() const noexcept { return now_; }
    /// One step of WalkingFigure::kStep.
    void advance();

private:
    struct Spring {
        Index a, b;
        double rest, stiffness; // m; share of the error that each end takes away at once
    };
    void sew();
    void add_strip(std::span<const Index> upper, std::span<const Index> lower);
    void add_springs();
    void advance_part(double from, double to);
    void keep_out(const FigurePose& from, const FigurePose& to);

    std::vector<Triangle> triangles_;
    std::vector<Vec3> now_, before_, start_;
    std::vector<Spring> springs_;
    std::vector<Index> waist_; // attached to the pelvis
    double time_;
    bool walks_;
};

} // namespace trocar::engine
