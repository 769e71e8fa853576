// The liver as an implicit shape: two lobes under the diaphragm, hollowed from below by stomach, kidney and gallbladder,
// from behind by the spine and the vena cava. The hilum, where the vessels enter, is the frame's origin.
#pragma once

#include "assets/anatomy/field.hpp"
#include "assets/anatomy/random.hpp"
#include "assets/anatomy/recipe.hpp"
#include "base/box.hpp"

#include <vector>

namespace trocar::anatomy {

class LiverShape final : public Field {
public:
    /// hilum  m, world: where the hepatic artery divides below the liver
    LiverShape(const Recipe& recipe, const Vec3& hilum, Random& random);

    [[nodiscard]] double value(const Vec3& p) const override;

    /// Millimetres of the average liver, from the hilum, to world metres.
    [[nodiscard]] Vec3 place(const Vec3& atlas_mm) const { return hilum_ + scale_.cwiseProduct(atlas_mm); }

    /// Holds the whole shape with a margin.
    [[nodiscard]] Box3 box() const;

private:
    struct Ellipsoid {
        Vec3 centre, radii; // mm in the atlas frame
        Mat3 turn;          // world axes to the ellipsoid's
        double blend;       // mm
    };
    struct Cut {
        Vec3 point, normal; // mm; unit
        double blend;       // mm
    };
    struct Wave {
        Vec3 direction; // 1/mm
        double phase, height;
    };

    Vec3 hilum_, scale_;
    std::vector<Ellipsoid> lobes_, hollows_;
    std::vector<Cut> cuts_;
    std::vector<Wave> waves_;
    double metric_; // m per atlas mm, of the thinnest axis

    [[nodiscard]] static double distance_to(const Ellipsoid& e, const Vec3& p);
};

} // namespace trocar::anatomy
