// Lays the arteries' axes: trunk vessels through anatomical way points, the hepatic tree's segments as smooth curves, every
// branch leaving its parent along the parent's own axis.
#pragma once

#include "assets/anatomy/anatomy.hpp"
#include "assets/anatomy/hepatic_tree.hpp"
#include "assets/anatomy/vessel_field.hpp"

#include <string>
#include <vector>

namespace trocar::anatomy {

/// A stretch of a vessel with one name and one radius; its last way point is where the next one begins.
struct Leg {
    std::string name;
    double radius;            // m
    std::vector<Vec3> points; // m, way points after the previous leg's last
    bool intrahepatic = false;
    double end_radius = 0.0; // m, 0: as radius
};

/// A run of legs that one curve follows through its forks.
struct VesselPlan {
    Index parent = kNoIndex;    // plan it leaves
    std::size_t parent_leg = 0; // leg of that plan
    Vec3 attach = Vec3::Zero(); // m, fork on (or near) the parent's axis
    bool tangential = false;    // turns away from the parent's axis in an arc, instead of starting across it
    double least_bend = 0.0095; // m, sharper bends are relaxed to this radius
    double funnel = 0.0;        // m, extra radius at its mouth in the parent's wall
    std::vector<Leg> legs;
};

/// A vessel laid out: one tube with its names.
struct LaidVessel {
    Tube tube;
    double spacing = 0.0;             // m
    Index parent = kNoIndex;          // vessel
    std::size_t parent_leg = 0;       // leg of that vessel
    std::size_t parent_sample = 0;    // where on the parent it begins
    std::size_t mouth = 0;            // first sample outside the parent's wall
    std::vector<std::size_t> leg_end; // [leg] last sample
    std::vector<Leg> legs;
};

/// World position where the common hepatic artery's last leg divides, and the direction in which it gets there.
struct Hilum {
    Vec3 position, approach;
};

/// Way points of all vessels outside the liver, in the seed's variation. hepatic_flow sizes the hepatic arteries.
class TrunkAtlas {
public:
    TrunkAtlas(const Recipe& recipe, Random& random);
    [[nodiscard]] Hilum hilum() const;
    /// Plans, parents first: 0 is iliac and aorta; one runs from the coeliac trunk to the end of the proper hepatic artery.
    [[nodiscard]] std::vector<VesselPlan> plans(double proper_hepatic_radius) const;

private:
    Recipe recipe_;
    std::vector<Vec3> shift_; // m, of the way points
    [[nodiscard]] Vec3 at(double x, double y, double z, std::size_t shift) const;
    [[nodiscard]] VesselPlan coeliac(double proper_hepatic_radius) const;
};

/// Extends the plan that ends in the proper hepatic artery by the right hepatic artery and its straightest continuation, and adds one per
/// further branch.
void add_tree_plans(const Recipe& recipe, const HepaticTree& tree, std::vector<VesselPlan>& plans);

/// Curves, radii, fillets. BadMesh when vessels come too near to each other for one clean surface.
[[nodiscard]] Result<std::vector<LaidVessel>> lay_vessels(const std::vector<VesselPlan>& plans);

} // namespace trocar::anatomy
