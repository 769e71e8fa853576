#include "assets/anatomy/liver.hpp"

#include <cmath>

namespace seldinger::anatomy {
namespace {

Mat3 turn_about(int axis, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    Mat3 m = Mat3::Identity();
    m(u, u) = c;
    m(u, v) = s;
    m(v, u) = -s;
    m(v, v) = c;
    return m;
}

struct AtlasPart {
    Vec3 centre, radii; // mm from the hilum; x right, y front, z up
    int axis;           // turned about it
    double angle;       // rad
    double blend;       // mm
    double freedom;     // mm a patient's part may be moved
};

const AtlasPart kLobes[] = {
    {{40, -4, 2}, {66, 74, 72}, 1, 0.0, 0, 2.5},     // right lobe
    {{-24, 24, 30}, {70, 45, 36}, 1, 0.18, 30, 3.0}, // left lobe, its tip towards the spleen and up
    {{-4, -36, 16}, {24, 22, 30}, 0, 0.0, 16, 2.0},  // caudate lobe
};
const AtlasPart kHollows[] = {
    {{-36, -14, -56}, {76, 76, 68}, 1, 0.25, 14, 2.5},  // stomach and bowel: the visceral face
    {{-46, -78, 0}, {36, 36, 400}, 0, 0.0, 14, 1.5},    // spine and aorta
    {{-8, -66, 0}, {13, 14, 400}, 0, 0.0, 7, 1.5},      // vena cava
    {{56, -92, -56}, {40, 40, 46}, 0, 0.0, 12, 3.0},    // right kidney
    {{-50, 22, 112}, {66, 60, 58}, 0, 0.0, 16, 3.0},    // heart
    {{-21, 78, 2}, {4.5, 26, 30}, 0, 0.3, 7, 2.0},      // umbilical fissure in the front margin
    {{24, 44, -42}, {12, 32, 15}, 0, -0.25, 8, 2.5},    // gallbladder
};

} // namespace

LiverShape::LiverShape(const Recipe& recipe, const Vec3& hilum, Random& random)
    : hilum_(hilum), scale_(recipe.liver_width / 200, recipe.liver_depth / 150, recipe.liver_height / 145) {
    const auto draw = [&](const AtlasPart& part) {
        Ellipsoid e;
        e.centre = part.centre + recipe.variation * part.freedom * random.cube();
        e.radii = part.radii.cwiseProduct(Vec3::Ones() + 0.035 * recipe.variation * random.cube());
        e.turn = turn_about(part.axis, part.angle + 0.06 * recipe.variation * random.uniform(-1, 1));
        e.blend = part.blend;
        return e;
    };
    for (const AtlasPart& part : kLobes) lobes_.push_back(draw(part));
    for (const AtlasPart& part : kHollows) hollows_.push_back(draw(part));
    margin_point_ = Vec3(62, 10, -52) + 2.0 * recipe.variation * random.cube();
    margin_normal_ = Vec3(-0.30, -0.42, -0.86).normalized();
    for (int i = 0; i < 6; ++i) {
        const double period = random.uniform(45, 110); // mm: no bump smaller than a hand's width of tissue
        waves_.push_back({random.cube().normalized() * (2 * M_PI / period), random.uniform(0, 2 * M_PI),
                          random.uniform(0.4, 0.9) * recipe.variation});
    }
    metric_ = scale_.minCoeff();
}

double LiverShape::distance_to(const Ellipsoid& e, const Vec3& p) {
    const Vec3 q = (e.turn * (p - e.centre)).cwiseQuotient(e.radii);
    const double reach = q.norm();
    const double slope = q.cwiseQuotient(e.radii).norm();
    // First-order distance; at the very centre it would be 0/0.
    return slope > 1e-9 ? reach * (reach - 1) / slope : -e.radii.minCoeff();
}

double LiverShape::value(const Vec3& world) const {
    const Vec3 p = (world - hilum_).cwiseQuotient(scale_);
    double d = distance_to(lobes_[0], p);
    for (std::size_t i = 1; i < lobes_.size(); ++i) d = smooth_min(d, distance_to(lobes_[i], p), lobes_[i].blend);
    d = smooth_max(d, (p - margin_point_).dot(margin_normal_), 22);
    for (const Ellipsoid& hollow : hollows_) d = smooth_max(d, -distance_to(hollow, p), hollow.blend);
    for (const Wave& w : waves_) d += w.height * std::sin(w.direction.dot(p) + w.phase);
    return d * metric_;
}

Box3 LiverShape::box() const {
    Box3 box;
    box.add(place({-125, -110, -100}));
    box.add(place({135, 105, 105}));
    return box;
}

} // namespace seldinger::anatomy
