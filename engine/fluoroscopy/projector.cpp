#include "engine/fluoroscopy/projector.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>

namespace trocar::engine {

namespace {

constexpr int kSubpixelBits = 8;
constexpr std::int32_t kSubpixels = 1 << kSubpixelBits;
constexpr double kNearest = 1e-3;                               // of the source-detector distance: nothing nearer to the source is seen
constexpr double kFarthestPixel = 1 << 20;                      // beyond that places are moved to it: far outside any detector
constexpr double kLeastCosine = 0.05;                           // of a thin shell against a ray: its attenuation there is bounded
constexpr double kMostValue = 4e18;                             // of a sum's one term

/// Of the pixel whose centre is the first at or beyond this place.
std::int32_t first_pixel(std::int32_t place) noexcept { return (place + kSubpixels / 2 - 1) >> kSubpixelBits; }
/// The last one at or before it.
std::int32_t last_pixel(std::int32_t place) noexcept { return (place - kSubpixels / 2) >> kSubpixelBits; }

struct SnappedVertex {
    std::int32_t x, y;
    double over_depth; // 1/m
};

/// E(x, y) >= 0 on its inner side; of the places on an edge itself one of its two sides has them.
struct Edge {
    std::int64_t step_x, step_y, value; // a pixel to the right, down; at the first pixel

    Edge(const SnappedVertex& a, const SnappedVertex& b, std::int64_t x, std::int64_t y) noexcept {
        const std::int64_t dx = std::int64_t{b.x} - a.x, dy = std::int64_t{b.y} - a.y;
        step_x = -dy * kSubpixels;
        step_y = dx * kSubpixels;
        value = dx * (y - a.y) - dy * (x - a.x);
        bias = dy < 0 || (dy == 0 && dx > 0) ? 0 : -1; // the opposite way round has the other
    }
    std::int64_t bias;
};

/// Rows of the picture, shared out to threads.
struct Band {
    std::int32_t begin, end, width;
};

/// pixel(place, enters, depth), at each pixel whose ray passes through the triangle: does it go in there, and how far from the source
/// along the axis, in metres.
template <class Pixel>
void draw_triangle(SnappedVertex a, SnappedVertex b, SnappedVertex c, const Band& band, Pixel&& pixel) {
    const auto [least_y, most_y] = std::minmax({a.y, b.y, c.y});
    const std::int32_t y0 = std::max(first_pixel(least_y), band.begin), y1 = std::min(last_pixel(most_y), band.end - 1);
    if (y0 > y1) return;
    const auto [least_x, most_x] = std::minmax({a.x, b.x, c.x});
    const std::int32_t x0 = std::max(first_pixel(least_x), 0), x1 = std::min(last_pixel(most_x), band.width - 1);
    if (x0 > x1) return;
    std::int64_t area = std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
    if (area == 0) return;
    const bool enters = area > 0; // rows run down: what faces the source turns the other way round
    if (!enters) {
        std::swap(b, c);
        area = -area;
    }
    const std::int64_t px = std::int64_t{x0} * kSubpixels + kSubpixels / 2, py = std::int64_t{y0} * kSubpixels + kSubpixels / 2;
    const Edge bc(b, c, px, py), ca(c, a, px, py), ab(a, b, px, py);
    const auto blend = [&](std::int64_t wa, std::int64_t wb, std::int64_t wc) {
        return static_cast<double>(wa) * a.over_depth + static_cast<double>(wb) * b.over_depth + static_cast<double>(wc) * c.over_depth;
    };
    const double step = blend(bc.step_x, ca.step_x, ab.step_x), whole = static_cast<double>(area);
    for (std::int32_t y = y0; y <= y1; ++y) {
        const std::int64_t down = y - y0;
        const std::int64_t ra = bc.value + down * bc.step_y, rb = ca.value + down * ca.step_y, rc = ab.value + down * ab.step_y;
        std::int64_t ea = ra + bc.bias, eb = rb + ca.bias, ec = rc + ab.bias;
        const double row = blend(ra, rb, rc);
        const std::size_t place = static_cast<std::size_t>(y) * static_cast<std::size_t>(band.width);
        for (std::int32_t x = x0; x <= x1; ++x, ea += bc.step_x, eb += ca.step_x, ec += ab.step_x)
            if ((ea | eb | ec) >= 0) pixel(place + static_cast<std::size_t>(x), enters, whole / (row + static_cast<double>(x - x0) * step));
    }
}

/// Work on the rows of a picture: the same whatever the number of threads, each row is one thread's.
template <class Work>
void share_rows(std::int32_t rows, std::int32_t columns, unsigned threads, Work&& work) {
    const std::int32_t bands = std::clamp<std::int32_t>(static_cast<std::int32_t>(threads), 1, std::max(rows, 1));
    const auto band = [&](std::int32_t k) { return Band{rows * k / bands, rows * (k + 1) / bands, columns}; };
    std::vector<std::thread> others;
    for (std::int32_t k = 1; k < bands; ++k) others.emplace_back([&work, own = band(k)] { work(own); });
    work(band(0));
    for (std::thread& one : others) one.join();
}

std::int64_t to_sum(double value) noexcept { return static_cast<std::int64_t>(std::clamp(value, -kMostValue, kMostValue)); }

} // namespace

Projector::Projector(const ConeBeam& beam, unsigned threads) : beam_(beam), threads_(std::max(threads, 1u)) {}

void Projector::snap(std::span<const Vec3> vertices) {
    x_.resize(vertices.size());
    y_.resize(vertices.size());
    near_.resize(vertices.size());
    const XrayProjection p = beam_.projection();
    const double nearest = kNearest * beam_.sid, most = kFarthestPixel;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        const Vec3& v = vertices[i];
        const double z = p(2, 0) * v.x() + p(2, 1) * v.y() + p(2, 2) * v.z() + p(2, 3);
        if (!(z >= nearest)) {
            near_[i] = 0.0;
            continue;
        }
        const double over = 1.0 / z;
        const double u = (p(0, 0) * v.x() + p(0, 1) * v.y() + p(0, 2) * v.z() + p(0, 3)) * over;
        const double w = (p(1, 0) * v.x() + p(1, 1) * v.y() + p(1, 2) * v.z() + p(1, 3)) * over;
        near_[i] = over;
        // to the nearest, halves up: adding 2^20 keeps it positive, so that the cast rounds down
        x_[i] = static_cast<std::int32_t>((std::clamp(u, -most, most) + most) * kSubpixels + 0.5) - (1 << 28);
        y_[i] = static_cast<std::int32_t>((std::clamp(w, -most, most) + most) * kSubpixels + 0.5) - (1 << 28);
    }
}

namespace {

/// What lies beyond the nearest plane of a triangle that crosses it: one or two triangles. Cuts of an edge are found from its vertex of
/// the lower index on, so that both triangles there have the same.
template <class Draw>
void clip_triangle(const Triangle& t, std::span<const Vec3> vertices, const ConeBeam& beam, double nearest, Draw&& draw) {
    std::array<Vec3, 4> kept;
    std::size_t count = 0;
    const auto depth = [&](const Vec3& p) { return (p - beam.source).dot(beam.along) - nearest; };
    for (std::size_t k = 0; k < 3; ++k) {
        const Index from = t[k], to = t[(k + 1) % 3];
        const double here = depth(vertices[from]), there = depth(vertices[to]);
        if (here >= 0.0) kept[count++] = vertices[from];
        if ((here >= 0.0) == (there >= 0.0)) continue;
        const Index low = std::min(from, to), high = std::max(from, to);
        const double at_low = depth(vertices[low]), at_high = depth(vertices[high]);
        kept[count++] = vertices[low] + at_low / (at_low - at_high) * (vertices[high] - vertices[low]);
    }
    for (std::size_t k = 2; k < count; ++k) draw(kept[0], kept[k - 1], kept[k]);
}

} // namespace

template <class Pixel>
void Projector::draw(const XraySurface& surface, const Pixel& pixel) {
    snap(surface.vertices);
    const double nearest = kNearest * beam_.sid;
    const XrayProjection p = beam_.projection();
    const auto snapped = [&](const Vec3& v) {
        const double over = 1.0 / std::max((v - beam_.source).dot(beam_.along), nearest);
        const auto place = [&](int row) {
            const double at = (p.row(row).head<3>().dot(v) + p(row, 3)) * over;
            return static_cast<std::int32_t>((std::clamp(at, -kFarthestPixel, kFarthestPixel) + kFarthestPixel) * kSubpixels + 0.5) - (1 << 28);
        };
        return SnappedVertex{place(0), place(1), over};
    };
    const auto rows = static_cast<std::int32_t>(beam_.pixels[1]), columns = static_cast<std::int32_t>(beam_.pixels[0]);
    share_rows(rows, columns, threads_, [&](const Band& band) {
        for (std::size_t k = 0; k < surface.triangles.size(); ++k) {
            const Triangle& t = surface.triangles[k];
            const auto own = [&](std::size_t place, bool enters, double depth) { pixel(k, place, enters, depth); };
            const double a = near_[t[0]], b = near_[t[1]], c = near_[t[2]];
            if (a > 0.0 && b > 0.0 && c > 0.0)
                draw_triangle({x_[t[0]], y_[t[0]], a}, {x_[t[1]], y_[t[1]], b}, {x_[t[2]], y_[t[2]], c}, band, own);
            else if (a > 0.0 || b > 0.0 || c > 0.0)
                clip_triangle(t, surface.vertices, beam_, nearest,
                              [&](const Vec3& q0, const Vec3& q1, const Vec3& q2) { draw_triangle(snapped(q0), snapped(q1), snapped(q2), band, own); });
        }
    });
}

void Projector::add(const XraySurface& surface, AttenuationSums& sums) {
    sums.resize(std::size_t{beam_.pixels[0]} * beam_.pixels[1], 0);
    if (surface.shell > 0.0) {
        std::vector<std::int64_t> sheet(surface.triangles.size());
        for (std::size_t k = 0; k < sheet.size(); ++k) {
            const Triangle& t = surface.triangles[k];
            const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
            const Vec3 normal = (b - a).cross(c - a), ray = (a + b + c) / 3.0 - beam_.source;
            const double across = std::abs(normal.dot(ray)), whole = normal.norm() * ray.norm();
            const double cosine = whole > 0.0 ? std::max(across / whole, kLeastCosine) : 1.0;
            const double along = ray.norm() > 0.0 ? std::abs(ray.dot(beam_.along)) / ray.norm() : 1.0; // one over the obliquity
            sheet[k] = to_sum(surface.attenuation * surface.shell / cosine * along * kAttenuationUnit);
        }
        draw(surface, [&](std::size_t k, std::size_t place, bool, double) { sums[place] += sheet[k]; });
    } else if (!surface.per_triangle.empty()) {
        draw(surface, [&](std::size_t k, std::size_t place, bool enters, double depth) {
            const std::int64_t value = to_sum(surface.per_triangle[k] * kAttenuationUnit * depth);
            sums[place] += enters ? -value : value;
        });
    } else {
        const double scale = surface.attenuation * kAttenuationUnit;
        draw(surface, [&](std::size_t, std::size_t place, bool enters, double depth) {
            const auto value = static_cast<std::int64_t>(scale * depth); // bounded: no depth is beyond the scene
            sums[place] += enters ? -value : value;
        });
    }
}

void Projector::add_depth(const XraySurface& surface, std::vector<double>& depth) {
    depth.resize(std::size_t{beam_.pixels[0]} * beam_.pixels[1], std::numeric_limits<double>::infinity());
    draw(surface, [&](std::size_t, std::size_t place, bool, double d) { depth[place] = std::min(depth[place], d); });
}

void Projector::attenuations(const AttenuationSums& sums, std::vector<double>& attenuation) const {
    const std::size_t columns = beam_.pixels[0];
    attenuation.resize(sums.size());
    for (std::size_t y = 0; y < beam_.pixels[1]; ++y)
        for (std::size_t x = 0; x < columns; ++x) {
            const std::int64_t sum = sums[y * columns + x];
            attenuation[y * columns + x] =
                sum == 0 ? 0.0 : static_cast<double>(sum) / kAttenuationUnit * beam_.obliquity(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
        }
}

} // namespace trocar::engine
