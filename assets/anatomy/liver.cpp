#include "assets/anatomy/liver.hpp"

#include <cmath>

namespace trocar::anatomy {
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

const Vec3 kAtlasSize(202, 152, 130); // mm, extent of the average shape below

const AtlasPart kLobes[] = {
    {{40, -4, 2}, {66, 74, 72}, 1, 0.0, 0, 2.5},     // right lobe
    {{-22, 22, 24}, {76, 54, 44}, 1, 0.10, 34, 3.0}, // left lobe, its tip towards the spleen
    {{-4, -34, 16}, {24, 22, 30}, 0, 0.0, 18, 2.0},  // caudate lobe
};
const AtlasPart kHollows[] = {
    {{-40, -22, -54}, {80, 78, 70}, 1, 0.30, 14, 2.0}, // stomach and bowel: the visceral face
    {{-4, 2, -10}, {28, 14, 13}, 1, -0.25, 18, 1.5},   // porta hepatis, where the vessels enter
    {{-46, -78, 0}, {36, 36, 400}, 0, 0.0, 16, 1.5},   // spine and aorta
    {{-8, -67, 0}, {13, 14, 400}, 0, 0.0, 9, 1.5},     // vena cava
    {{58, -94, -58}, {40, 40, 46}, 0, 0.0, 14, 3.0},   // right kidney
    {{-58, 24, 132}, {84, 74, 70}, 1, 0.12, 26, 3.0},  // heart
    {{-20, 84, -2}, {5, 23, 26}, 0, 0.35, 10, 2.0},    // umbilical fissure in the front margin
    {{22, 36, -42}, {12, 28, 13}, 0, -0.35, 12, 2.0},  // gallbladder
};

struct AtlasCut {
    Vec3 point, normal; // mm; the liver lies on the other side
    double blend;       // mm
};
const AtlasCut kCuts[] = {
    {{62, 10, -50}, {-0.22, -0.52, -0.82}, 14}, // under the right lobe, towards the kidney
    {{6, 40, -24}, {-0.58, 0.06, -0.81}, 10},   // the sharp front margin, rising to the left
};

} // namespace

LiverShape::LiverShape(const Recipe& recipe, const Vec3& hilum, Random& random)
    : hilum_(hilum), scale_(Vec3(recipe.liver_width, recipe.liver_depth, recipe.liver_height).cwiseQuotient(kAtlasSize)) {
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
    for (const AtlasCut& cut : kCuts)
        cuts_.push_back({cut.point + 2.0 * recipe.variation * random.cube(),
                         (cut.normal + 0.05 * recipe.variation * random.cube()).normalized(), cut.blend});
    for (int i = 0; i < 6; ++i) {
        const double period = random.uniform(45, 110); // mm: no bump smaller than 8 cm of tissue
        waves_.push_back(
            {random.cube().normalized() * (2 * M_PI / period), random.uniform(0, 2 * M_PI), random.uniform(0.4, 0.9) * recipe.variation});
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
    for (const Cut& cut : cuts_) d = smooth_max(d, (p - cut.point).dot(cut.normal), cut.blend);
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

} // namespace trocar::anatomy
