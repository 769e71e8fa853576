// Tissue against the literature's cases: bending, twist, near incompressibility, vibration, laws pulled in two directions, stress that relaxes.
#include "bench/literature.hpp"
#include "fem/tissue/classical_cases.hpp"
#include "fem/tissue/law_validation.hpp"
#include "fem/tissue/validation.hpp"
#include "fem/tissue/wall_cases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

constexpr double kTissueTarget = 0.03, kCells = 6.0; // [-], cells across
constexpr fem::TetElements kPatched = fem::TetElements::Patched;

LiteratureRow tissue_row(std::string name, std::string quantity, std::string source, double reference, std::vector<double> sizes) {
    LiteratureRow row;
    row.name = std::move(name), row.quantity = std::move(quantity), row.source = std::move(source);
    row.reference = reference;
    row.size_name = "cells";
    row.sizes = std::move(sizes);
    row.stated = kCells;
    row.target = row.bound = kTissueTarget;
    return row;
}

template <class Measure>
void fill(std::vector<LiteratureRow>& rows, LiteratureRow row, const Measure& measure) {
    for (const double size : row.sizes) row.measured.push_back(measure(static_cast<Index>(size)));
    rows.push_back(std::move(row));
}

/// Of any case that has a ratio of 1 at each of several Poisson's ratios.
template <class Ratio>
void fill_ratios(std::vector<LiteratureRow>& rows, const char* name, const char* quantity, const char* source, const std::vector<double>& ratios,
                 const std::vector<double>& sizes, const Ratio& ratio) {
    for (const double nu : ratios)
        fill(rows, tissue_row(name, fmt::format("{}, nu {:g}", quantity, nu), source, 1.0, sizes),
             [&](Index cells) { return ratio(cells, nu, kPatched); });
}

void bend_and_twist(std::vector<LiteratureRow>& rows, bool quick) {
    const std::vector<double> sizes = quick ? std::vector<double>{4, 6} : std::vector<double>{2, 4, 6, 8};
    fill_ratios(rows, "cantilever, 4 times as long as thick", "tip over Timoshenko's", "Timoshenko, Cowper 1966", {0.3, 0.45, 0.49}, sizes,
                [](Index cells, double nu, fem::TetElements elements) { return fem::cantilever_ratio(cells, nu, elements); });
    LiteratureRow cook = tissue_row("Cook's membrane", "tip, plane stress, nu 1/3", "Cook 1974", fem::kCookTip,
                                    quick ? std::vector<double>{8, 16} : std::vector<double>{8, 16, 32});
    cook.kind = ReferenceKind::Quoted;
    cook.stated = 16.0;
    fill(rows, cook, [](Index cells) { return fem::cook_tip(cells, kPatched); });
    fill_ratios(rows, "torsion of a square bar", "torque over Saint-Venant's", "Saint-Venant 1855", {0.3, 0.49}, sizes, fem::torsion_ratio);
    constexpr std::pair<const char*, fem::MaterialLaw> kLaws[] = {{"neo_hookean", fem::MaterialLaw::NeoHookean},
                                                                  {"mooney_rivlin", fem::MaterialLaw::MooneyRivlin},
                                                                  {"ogden", fem::MaterialLaw::Ogden},
                                                                  {"hgo", fem::MaterialLaw::Hgo}};
    for (const auto& [name, law] : kLaws) {
        LiteratureRow row = tissue_row("column twisted by 360 degrees and back", fmt::format("farthest node from rest over the side, {}", name),
                                       "Bonet, Gil & Ortigosa 2015: the column", 0.0, quick ? std::vector<double>{2} : std::vector<double>{2, 4});
        row.stated = row.sizes.back();
        row.target = row.bound = 1e-6;
        fill(rows, row, [law = law](Index cells) { return fem::turn_bar(law, cells).left; });
        if (quick) break;
    }
}

void press_and_swell(std::vector<LiteratureRow>& rows, bool quick) {
    const std::vector<double> sizes = quick ? std::vector<double>{4, 6} : std::vector<double>{2, 4, 6, 8};
    fill(rows,
         tissue_row("nearly incompressible block pressed on its middle", "sinks at nu 0.4999 over that at 0.49", "the limit, which is near", 1.0, {4, 8, 12}),
         [](Index cells) { return fem::block_sink(cells, 0.4999, kPatched) / fem::block_sink(cells, 0.49, kPatched); });
    rows.back().stated = 8.0;
    fill_ratios(rows, "hollow sphere under pressure, radii 1 and 2", "bore's widening over Lame's", "Lame 1852", {0.3, 0.49, 0.4999}, sizes,
                fem::hollow_sphere_ratio);
    const std::vector<double> edges = quick ? std::vector<double>{24, 48} : std::vector<double>{16, 24, 48, 64};
    for (const double nu : {0.3, 0.45, 0.49}) {
        LiteratureRow wall = tissue_row("vessel's wall, a tenth of its radius thick, one layer, under pressure", fmt::format("sphere's widening over Lame's, nu {:g}", nu),
                                        "Lame 1852", 1.0, edges);
        wall.size_name = "triangles' edges around";
        wall.stated = 48.0;
        fill(rows, std::move(wall), [nu](Index around) { return fem::shell_ratio(around, 1, nu, fem::TetElements::Prisms); });
    }
    LiteratureRow pressed = tissue_row("vessel's wall, 0.2 of its bore's radius thick, one layer, pressed from inside over 0.3 of that",
                                       "way over that of four layers of patches, 54 edges around, nu 0.45", "a finer mesh of other elements", 1.0,
                                       quick ? std::vector<double>{16, 24} : std::vector<double>{16, 24, 36, 48});
    pressed.kind = ReferenceKind::Beside;
    pressed.size_name = "triangles' edges around";
    pressed.stated = 24.0;
    const double fine = fem::pressed_tube_way(54, 4, 0.45, kPatched); // coarser ones are 3 % apart from one another
    fill(rows, std::move(pressed), [&](Index around) { return fem::pressed_tube_way(around, 1, 0.45, fem::TetElements::Prisms) / fine; });
    LiteratureRow plate = tissue_row("vessel's wall, flat, a fortieth of its side thick, one layer, uneven triangles, clamped around, under pressure",
                                     "way of its middle over the thin plate's", "Timoshenko & Woinowsky-Krieger 1959", 1.0,
                                     quick ? std::vector<double>{8, 16} : std::vector<double>{8, 16, 24, 32});
    plate.size_name = "triangles' edges along a side";
    plate.stated = 16.0;
    fill(rows, std::move(plate), [](Index cells) { return fem::pressed_plate_ratio(cells, 1.0 / 40.0, 0.25, fem::TetElements::Prisms); });
    fill_ratios(rows, "artery's ring under pressure, radii 1 and 1.4", "bore's widening over Lame's", "Lame 1852, plane stress", {0.3, 0.49}, sizes,
                fem::ring_ratio);
    for (const double widening : {0.1, 0.3}) {
        LiteratureRow artery = tissue_row("artery's media that a load on its bore widens, radii 1 and 1.4 (Holzapfel, Gasser & Ogden 2000)",
                                          fmt::format("bore's widening over the closed form's {:g} of its radius, hgo", widening),
                                          "balance across the wall, integrated", 1.0, quick ? std::vector<double>{2, 4} : std::vector<double>{2, 4, 6});
        fill(rows, std::move(artery), [&](Index cells) { return fem::artery_ratio(cells, widening, kPatched); });
    }
}

void vibrate(std::vector<LiteratureRow>& rows, bool quick) {
    fill_ratios(rows, "free vibration of a cantilever, 10 times as long as thick", "first frequency over Timoshenko's", "Timoshenko 1921", {0.3, 0.49},
                quick ? std::vector<double>{4, 6} : std::vector<double>{2, 4, 6}, fem::bending_mode_ratio);
    LiteratureRow along = tissue_row("free vibration of a bar along itself", "first frequency over sqrt(E / rho) / 2 L", "d'Alembert", 1.0, {10, 20, 40});
    along.stated = 40.0;
    fill(rows, along, [](Index cells) { return fem::axial_mode_ratio(fem::MaterialLaw::NeoHookean, cells); });
}

void pull_plates(std::vector<LiteratureRow>& rows) {
    for (const fem::NamedMaterial& one : fem::biaxial_materials()) {
        LiteratureRow row = tissue_row("plates pulled in two directions", fmt::format("stress off the closed form, {}", one.name), "Rivlin 1948, Ogden 1972, Holzapfel 2000",
                                       0.0, {1, 8});
        row.size_name = "tetrahedra that share a gradient";
        row.stated = 8.0;
        row.target = row.bound = 1e-8;
        fill(rows, row, [&](Index shared) { return fem::biaxial_error(one.material, shared > 1 ? kPatched : fem::TetElements::Linear); });
    }
}

void relax_and_creep(std::vector<LiteratureRow>& rows) {
    LiteratureRow held = tissue_row("relaxation of a held shear", "stress off the series, worst of all laws", "Prony series", 0.0, {});
    LiteratureRow loaded = tissue_row("creep under a held shear stress", "shear off the closed form", "standard linear solid", 0.0, {});
    for (LiteratureRow* row : {&held, &loaded}) {
        row->size_name = "steps a second";
        row->sizes = {100, 500, 1000};
        row->stated = 1000.0;
        row->target = row->bound = 1e-3;
    }
    for (const double rate : held.sizes) {
        double worst = 0.0;
        for (const fem::MaterialLaw law : {fem::MaterialLaw::StVK, fem::MaterialLaw::Corotational, fem::MaterialLaw::NeoHookean,
                                           fem::MaterialLaw::MooneyRivlin, fem::MaterialLaw::Ogden, fem::MaterialLaw::Hgo})
            worst = std::max(worst, fem::relaxation_error(law, kPatched, 1.0 / rate));
        held.measured.push_back(worst);
        loaded.measured.push_back(fem::creep_error(kPatched, 1.0 / rate));
    }
    rows.push_back(std::move(held));
    rows.push_back(std::move(loaded));
}

} // namespace

std::vector<LiteratureRow> measure_tissue_literature(bool quick) {
    std::vector<LiteratureRow> rows;
    bend_and_twist(rows, quick);
    press_and_swell(rows, quick);
    vibrate(rows, quick);
    pull_plates(rows);
    relax_and_creep(rows);
    return rows;
}

} // namespace trocar::engine
