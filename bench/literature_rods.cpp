// Rods against the literature's cases: large bending, buckling under twist and weight, whirling, and how torque is passed on.
#include "bench/literature.hpp"
#include "fem/rod/closed_forms.hpp"
#include "fem/rod/validation.hpp"

#include <cmath>

namespace trocar::engine {

namespace {

constexpr double kRodTarget = 0.01, kRodSegments = 32.0; // [-], segments
constexpr const char* kCoarse = "its 7.8 turns have four segments each there";

LiteratureRow rod_row(const char* name, const char* quantity, const char* source, double reference) {
    LiteratureRow row;
    row.name = name, row.quantity = quantity, row.source = source;
    row.reference = reference;
    row.size_name = "segments";
    row.stated = kRodSegments;
    row.target = row.bound = kRodTarget;
    return row;
}

std::vector<double> rod_sizes(bool quick) { return quick ? std::vector<double>{16, 32} : std::vector<double>{8, 16, 32, 64}; }

/// Rows that one measurement fills at each size.
template <class Measure>
void fill(std::vector<LiteratureRow>& rows, std::vector<LiteratureRow> added, const std::vector<double>& sizes, const Measure& measure) {
    for (LiteratureRow& row : added) row.sizes = sizes;
    for (const double size : sizes) {
        const std::vector<double> values = measure(static_cast<int>(size));
        for (std::size_t k = 0; k < added.size(); ++k) added[k].measured.push_back(values[k]);
    }
    for (LiteratureRow& row : added) rows.push_back(std::move(row));
}

void bend_rods(std::vector<LiteratureRow>& rows, bool quick) {
    const std::vector<double> sizes = rod_sizes(quick);
    std::vector<LiteratureRow> tip;
    for (int axis = 0; axis < 3; ++axis) {
        constexpr const char* kQuantity[] = {"tip, x", "tip, y", "tip, z: out of its plane"};
        tip.push_back(rod_row("45-degree bend", kQuantity[axis], "Simo & Vu-Quoc 1986", fem::kBend45Tip[axis]));
        tip.back().kind = ReferenceKind::Quoted;
    }
    fill(rows, tip, sizes, [](int n) {
        const Vec3 at = fem::bend45_tip(n);
        return std::vector{at.x(), at.y(), at.z()};
    });
    fill(rows, {rod_row("roll-up by a moment 2 pi EI / L", "gap of the circle over the length", "closed circle", 0.0)}, sizes,
         [](int n) { return std::vector{fem::rolled_gap(n)}; });
    constexpr double kLoad = 5.0, kWeight = 10.0;
    const fem::ElasticaTip loaded = fem::loaded_elastica(kLoad), heavy = fem::heavy_elastica(kWeight);
    fill(rows,
         {rod_row("elastica under an end load, P L^2 / EI = 5", "tip aside, lengths", "Bisshopp & Drucker 1945, by shooting", loaded.across),
          rod_row("elastica under an end load, P L^2 / EI = 5", "tip along, lengths", "Bisshopp & Drucker 1945, by shooting", loaded.along)},
         sizes, [&](int n) {
             const fem::ElasticaTip end = fem::loaded_tip(n, kLoad);
             return std::vector{end.across, end.along};
         });
    fill(rows,
         {rod_row("heavy elastica, w L^3 / EI = 10", "tip aside, lengths", "elastica, by shooting", heavy.across),
          rod_row("heavy elastica, w L^3 / EI = 10", "tip along, lengths", "elastica, by shooting", heavy.along)},
         sizes, [&](int n) {
             const fem::ElasticaTip end = fem::heavy_tip(n, kWeight);
             return std::vector{end.across, end.along};
         });
}

void buckle_rods(std::vector<LiteratureRow>& rows, bool quick) {
    const std::vector<double> sizes = quick ? std::vector<double>{32} : std::vector<double>{16, 32, 64};
    fill(rows, {rod_row("Greenhill's twisted rod, both ends clamped", "M L / EI", "Greenhill 1883", fem::kGreenhillMoment)}, sizes,
         [](int n) { return std::vector{fem::greenhill_moment(n)}; });
    fill(rows, {rod_row("Michell's ring", "twist times GJ / (2 pi EI)", "Michell 1889", std::sqrt(3.0))}, sizes, [](int n) { return std::vector{fem::michell_twist(n)}; });
    fill(rows, {rod_row("Greenhill's column under its weight", "w L^3 / EI", "Greenhill 1881", fem::kHeavyColumn)},
         quick ? std::vector<double>{32} : std::vector<double>{8, 16, 32}, [](int n) { return std::vector{fem::column_weight(n)}; });
    const fem::HelicalBuckling closed = fem::helical_buckling(0.03, 27.0 * 2.0 * 3.14159265358979323846, 0.789 / 1.345);
    constexpr const char *kName = "helical buckling, 27 turns, slack 3 %", *kSource = "van der Heijden & Thompson 2000";
    std::vector<LiteratureRow> helix{rod_row(kName, "moment, M L / EI", kSource, closed.moment), rod_row(kName, "tension, T L^2 / EI", kSource, closed.tension),
                                     rod_row(kName, "envelope, largest distance", kSource, 0.0)};
    helix[1].bound = 0.4, helix[2].bound = 0.6;
    helix[1].reason = helix[2].reason = kCoarse;
    fill(rows, helix, quick ? std::vector<double>{32, 128} : std::vector<double>{32, 64, 128, 256}, [](int n) {
        const fem::BuckledHelix found = fem::buckle_helix(n);
        return std::vector{found.moment, found.tension, found.envelope};
    });
}

void turn_rods(std::vector<LiteratureRow>& rows, bool quick) {
    const std::vector<double> sizes = rod_sizes(quick);
    constexpr double kShare = 0.8;
    fill(rows,
         {rod_row("whirling of a bowed rod at 0.8 of its critical speed", "amplitude over the bow at rest", "Euler-Bernoulli, damped",
                  fem::whirling_tip(kShare * fem::kWhirlingSpeed, fem::kWhirlDamping * fem::kWhirlingSpeed))},
         sizes, [&](int n) { return std::vector{fem::whirl_ratio(n, kShare)}; });
    fill(rows, {rod_row("torque on a straight shaft", "T L / GJ over the wind-up", "Saint-Venant", 1.0)}, sizes,
         [](int n) { return std::vector{fem::wound_by_torque(n)}; });
    constexpr const char* kTwist = "Dupont et al. 2010: the tip's twist, by shooting";
    const std::vector<LiteratureRow> whip{rod_row("whip of a bent tip in a bent tube", "handle's angle where it snaps over the reference's", kTwist, 1.0),
                                          rod_row("torque transmission round a bend", "tip over handle, over the reference's", kTwist, 1.0)};
    fill(rows, whip, quick ? std::vector<double>{32} : std::vector<double>{16, 32, 64}, [](int n) {
        const fem::Whip found = fem::turn_in_bend(n, 30.0, 20.0);
        const fem::TurnedTip reference = fem::turned_tip(found.beta, found.share);
        return std::vector{found.handle / reference.snap, found.first_slope / reference.slope};
    });
}

} // namespace

std::vector<LiteratureRow> measure_rod_literature(bool quick) {
    std::vector<LiteratureRow> rows;
    bend_rods(rows, quick);
    buckle_rods(rows, quick);
    turn_rods(rows, quick);
    return rows;
}

} // namespace trocar::engine
