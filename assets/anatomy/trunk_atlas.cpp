#include "assets/anatomy/arteries.hpp"

#include <cmath>

namespace trocar::anatomy {
namespace {

// Groups of way points that a patient's variation shifts together.
enum Shift : std::size_t { kGroin, kPelvis, kLumbar, kUpper, kCoeliac, kHepatic, kHilumShift, kStubs, kShiftCount };
constexpr double kFreedom[kShiftCount] = {0.004, 0.006, 0.003, 0.002, 0.0015, 0.0025, 0.003, 0.004}; // m

constexpr std::size_t kAortaLeg = 1;   // of the first plan
constexpr double kCoeliacTurn = 0.016; // m, radius of the turn out of the aorta

/// Radius that carries both flows, by Murray's law with the cube.
double together(double a, double b) { return std::cbrt(a * a * a + b * b * b); }

} // namespace

TrunkAtlas::TrunkAtlas(const Recipe& recipe, Random& random) : recipe_(recipe) {
    for (const double freedom : kFreedom) shift_.push_back(freedom * recipe.variation * random.cube());
}

/// x right, y front, z up, mm.
Vec3 TrunkAtlas::at(double x, double y, double z, std::size_t shift) const { return 1e-3 * Vec3(x, y, z) + shift_[shift]; }

Hilum TrunkAtlas::hilum() const {
    const Vec3 position = at(45, 45, 318, kHilumShift);
    return {position, (position - at(35, 42, 302, kHepatic)).normalized()};
}

VesselPlan TrunkAtlas::coeliac(double proper_hepatic_radius) const {
    const double common = together(proper_hepatic_radius, 0.0018);
    const double trunk = together(together(common, 0.0027), 0.0015);
    const double angle = recipe_.coeliac_angle;
    VesselPlan plan;
    plan.parent = 0;
    plan.parent_leg = kAortaLeg;
    plan.attach = at(-10, 1, 272, kCoeliac);
    plan.funnel = 0.45 * trunk;
    plan.least_bend = 0.011;
    Leg leg{"coeliac", trunk, {}};
    Vec3 p = plan.attach;
    for (int k = 1; k <= 6; ++k) { // the turn, forwards and a little to the right
        const double turned = angle * k / 6;
        p = plan.attach + kCoeliacTurn * Vec3(0, 1 - std::cos(turned), std::sin(turned));
        leg.points.push_back(p);
    }
    leg.points.push_back(p + 0.007 * Vec3(0.06, std::sin(angle), std::cos(angle)));
    leg.points.push_back(p + 0.014 * Vec3(0.14, std::sin(angle), std::cos(angle)));
    plan.legs.push_back(leg);
    plan.legs.push_back({"common_hepatic", common, {at(-1, 36, 294, kHepatic), at(13, 41, 293, kHepatic), at(25, 41, 294, kHepatic)}});
    plan.legs.push_back({"proper_hepatic", proper_hepatic_radius, {at(36, 42, 303, kHepatic), hilum().position}});
    return plan;
}

std::vector<VesselPlan> TrunkAtlas::plans(double proper_hepatic_radius) const {
    const double aorta = recipe_.aorta_radius;
    std::vector<VesselPlan> plans;
    VesselPlan main;
    main.least_bend = 0.03;
    main.legs = {{"right_iliac",
                  0.0043,
                  {at(70, 76, 56, kGroin), at(66, 69, 72, kGroin), at(57, 53, 92, kPelvis), at(44, 34, 114, kPelvis),
                   at(27, 18, 134, kPelvis), at(12, 9, 153, kLumbar), at(3, 6.5, 168, kLumbar)},
                  false,
                  0.0056},
                 {"aorta",
                  0.79 * aorta,
                  {at(-1, 6, 178, kLumbar), at(-6, 6, 208, kLumbar), at(-9, 3, 240, kUpper), at(-10, 1, 272, kCoeliac),
                   at(-11, -3, 310, kUpper), at(-13, -9, 350, kUpper), at(-15, -14, 392, kUpper)},
                  false,
                  1.08 * aorta}};
    plans.push_back(main);
    const auto stub = [&](std::string name, const Vec3& attach, double radius, bool tangential, std::vector<Vec3> points) {
        VesselPlan plan;
        plan.parent = 0;
        plan.parent_leg = kAortaLeg;
        plan.attach = attach;
        plan.tangential = tangential;
        plan.legs = {{std::move(name), radius, std::move(points)}};
        plans.push_back(std::move(plan));
    };
    stub("left_iliac", at(-1, 6, 178, kLumbar), 0.0056, false,
         {at(-4, 6.5, 168, kLumbar), at(-13, 9, 153, kLumbar), at(-29, 18, 134, kPelvis), at(-46, 34, 114, kPelvis),
          at(-58, 52, 93, kPelvis)});
    stub("right_renal", at(-8, 4, 236, kUpper), 0.0028, false, {at(2, 4, 235, kUpper), at(16, -2, 232, kStubs), at(32, -12, 228, kStubs)});
    stub("left_renal", at(-8, 4, 238, kUpper), 0.0028, false,
         {at(-18, 4, 238, kUpper), at(-32, -2, 236, kStubs), at(-48, -12, 233, kStubs)});
    stub("superior_mesenteric", at(-9, 3, 256, kUpper), 0.0034, false,
         {at(-9, 13, 253.5, kUpper), at(-8, 20, 247, kUpper), at(-6, 25, 234, kUpper), at(-2, 27, 214, kStubs), at(4, 28, 196, kStubs)});
    plans.push_back(coeliac(proper_hepatic_radius));
    const auto coeliac_plan = static_cast<Index>(plans.size() - 1);
    const auto spring_from = [&](Index parent, std::size_t leg) {
        plans.back().parent = parent;
        plans.back().parent_leg = leg;
    };
    const std::vector<Leg> legs = plans.back().legs;
    const Vec3 fork = legs[0].points.back(), middle = legs[0].points[legs[0].points.size() - 2];
    stub("left_gastric", middle, 0.0015, true,
         {middle + Vec3(-0.003, 0.004, 0.006), middle + Vec3(-0.006, 0.006, 0.017), middle + Vec3(-0.013, 0.012, 0.026)});
    spring_from(coeliac_plan, 0);
    stub("splenic", fork, 0.0027, true,
         {fork + Vec3(-0.007, 0.005, 0.002), fork + Vec3(-0.020, 0.005, 0.0), fork + Vec3(-0.036, -0.004, 0.005),
          fork + Vec3(-0.052, -0.014, 0.003)});
    spring_from(coeliac_plan, 0);
    stub("gastroduodenal", legs[1].points.back(), 0.0018, true,
         {at(32, 43, 289, kHepatic), at(35, 46, 277, kHepatic), at(34, 47, 262, kHepatic)});
    spring_from(coeliac_plan, 1);
    return plans;
}

} // namespace trocar::anatomy
