// Keys of a body: surface, tissue, coarse tetrahedra, what holds and what moves it.
#pragma once

#include "base/repair.hpp"
#include "engine/scene/describe_place.hpp"
#include "engine/scene/presets.hpp"
#include "engine/scene/reader.hpp"
#include "engine/scene/scene.hpp"

namespace trocar::engine {

inline constexpr double kLargestShape = 10.0;   // m
inline constexpr double kSmallestLength = 1e-5; // m
inline constexpr double kUsualPoissonRatio = 0.495;

inline constexpr Range kYoungModuli{10.0, 3e10, false, 100.0, 1e8, "soft tissue is 0.1 kPa to 100 MPa, bone up to 30 GPa"};
inline constexpr Range kDensities{50.0, 23000.0, false, 200.0, 2500.0, "soft tissue is 900 to 1200 kg/m^3, lung from 200, bone up to 2000"};
inline constexpr Range kModuli{0.0, 1e10, false, 0.0, 1e8, "soft tissue is below 100 MPa"};
inline constexpr Range kOgdenModuli{-1e10, 1e10, false, -1e8, 1e8, "soft tissue is below 100 MPa"};
inline constexpr Range kOgdenPowers{-30.0, 30.0};

/// Part of the keys of "material".
struct MaterialKeys {
    using Struct = fem::Material;
    static auto of(auto& s) {
        using Law = fem::MaterialLaw;
        return described(
            {"tissue", "A tissue.", "", "law"},
            key(s.law,
                choice_field<Law>("law",
                                  {{"neo_hookean", Law::NeoHookean},
                                   {"corotational", Law::Corotational},
                                   {"stvk", Law::StVK},
                                   {"mooney_rivlin", Law::MooneyRivlin},
                                   {"ogden", Law::Ogden},
                                   {"hgo", Law::Hgo}},
                                  "Stable neo-Hookean, corotational linear, St. Venant-Kirchhoff, Mooney-Rivlin, Ogden with one to three "
                                  "terms, or Holzapfel-Gasser-Ogden: two families of fibres in a neo-Hookean ground. See docs/tissue.md.")),
            key(s.young_modulus, number_field("young_modulus", Dimension::Pressure, kYoungModuli,
                                              "Stiffness; of hgo that of the ground between its fibres.")
                                     .when({"neo_hookean", "corotational", "stvk", "hgo"})),
            key(s.c10, number_field("c10", Dimension::Pressure, kModuli, "On the first invariant; the shear modulus is 2 (c10 + c01).")
                           .when({"mooney_rivlin"})),
            key(s.c01, number_field("c01", Dimension::Pressure, kModuli, "On the second invariant.").when({"mooney_rivlin"})),
            key(s.mu1, number_field("mu1", Dimension::Pressure, kOgdenModuli,
                                    "Of the first term mu / alpha (l1^alpha + l2^alpha + l3^alpha - 3); the shear modulus is half the sum "
                                    "of mu alpha.")
                           .when({"ogden"})),
            key(s.alpha1, number_field("alpha1", Dimension::None, kOgdenPowers, "Of the first term.").when({"ogden"})),
            key(s.mu2, number_field("mu2", Dimension::Pressure, kOgdenModuli, "Of a second term.").when({"ogden"})),
            key(s.alpha2, number_field("alpha2", Dimension::None, kOgdenPowers, "Of a second term.").when({"ogden"})),
            key(s.mu3, number_field("mu3", Dimension::Pressure, kOgdenModuli, "Of a third term.").when({"ogden"})),
            key(s.alpha3, number_field("alpha3", Dimension::None, kOgdenPowers, "Of a third term.").when({"ogden"})),
            key(s.k1, number_field("k1", Dimension::Pressure, kModuli,
                                   "Stiffness of either family of fibres; they do not resist "
                                   "compression.")
                          .when({"hgo"})),
            key(s.k2, number_field("k2", Dimension::None, above(0.0, 1e4), "How fast fibres stiffen: exp(k2 E^2).").when({"hgo"})),
            key(s.kappa, number_field("kappa", Dimension::None, between(0.0, 1.0 / 3.0),
                                      "Dispersion of the fibres: 0 all along their direction, 1/3 in all directions alike.")
                             .when({"hgo"})),
            key(s.fibre1, vector_field("fibre1", Dimension::None, coordinate(),
                                       "Direction of the first family at rest; its length does "
                                       "not matter.")
                              .when({"hgo"})),
            key(s.fibre2, vector_field("fibre2", Dimension::None, coordinate(), "Of the second family.").when({"hgo"})),
            key(s.fibre_axis,
                vector_field("fibre_axis", Dimension::None, coordinate(),
                             "Of a vessel: fibres wind round the line through fibre_point along it, both ways; instead of fibre1 and "
                             "fibre2 where it is not 0.")
                    .when({"hgo"})),
            key(s.fibre_point, vector_field("fibre_point", Dimension::Length, coordinate(), "On that line.").when({"hgo"})),
            key(s.fibre_angle,
                number_field("fibre_angle", Dimension::Angle, between(-1.5708, 1.5708), "From the circumference towards the axis.")
                    .when({"hgo"})),
            key(s.poisson_ratio, number_field("poisson_ratio", Dimension::None,
                                              {0.0, 0.4999, false, 0.0, kUsualPoissonRatio,
                                               "steps shrink with the root of 1 - 2 nu; tissue is 0.45 to 0.495"},
                                              "0 compressible, 0.5 incompressible.")),
            key(s.density, number_field("density", Dimension::Density, kDensities, "Mass per volume.")),
            key(s.viscosity,
                number_field("viscosity", Dimension::Viscosity,
                             {0.0, 1e5, false, 0.0, 1e3, "on the strain rate; large values shrink the stable step"},
                             "Damps deformation: adds the stress 2 viscosity D, with D the rate of strain, see docs/tissue.md.")),
            key(s.mass_damping,
                number_field("mass_damping", Dimension::Rate, {0.0, 1e4, false, 0.0, 1e3, "drags every node towards rest"},
                             "Damps all motion, free flight too: adds the acceleration -mass_damping v, see docs/tissue.md.")),
            key(s.g1, number_field("g1", Dimension::None, between(0.0, 1e4),
                                   "Stress that relaxes: the shear modulus at once is 1 + g1 + g2 + g3 times that in the end.")),
            key(s.tau1, number_field("tau1", Dimension::Time, between(0.0, 1e6), "In which g1's share falls to 1/e.")),
            key(s.g2, number_field("g2", Dimension::None, between(0.0, 1e4), "Of a second branch.")),
            key(s.tau2, number_field("tau2", Dimension::Time, between(0.0, 1e6), "Of a second branch.")),
            key(s.g3, number_field("g3", Dimension::None, between(0.0, 1e4), "Of a third branch.")),
            key(s.tau3, number_field("tau3", Dimension::Time, between(0.0, 1e6), "Of a third branch.")),
            key(s.elements, choice_field<fem::TetElements>("elements",
                                                           {{"automatic", fem::TetElements::Automatic},
                                                            {"linear", fem::TetElements::Linear},
                                                            {"patched", fem::TetElements::Patched},
                                                            {"prisms", fem::TetElements::Prisms}},
                                                           "Linear tetrahedra, each for itself (they lock near incompressibility), or in "
                                                           "patches of eight that share a deformation gradient and do not; automatic: "
                                                           "patched above a Poisson's ratio of 0.4, but for StVK; prisms, of walls and their "
                                                           "default, bend as shells do. See docs/tissue.md.")));
    }
};
static_assert(describes_all<MaterialKeys>);

struct TissueKeys {
    using Struct = SceneBody;
    static auto of(auto& s) {
        return described({"material", "A tissue. The defaults are a soft liver.", "", "law"},
                         custom_key(choice_field("preset", preset_names(),
                                                 "A tissue of the literature, from which other keys here deviate. Their sources are in "
                                                 "docs/tissue.md."),
                                    kReadApart, s.preset), // before all others: read_body
                         inline_keys<MaterialKeys>(s.material),
                         key(s.fibre_course, choice_field<FibreCourse>("fibre_course", {{"given", FibreCourse::Given}, {"centreline", FibreCourse::Centreline}, {"radial", FibreCourse::Radial}},
                                                                       "Of hollow bodies: centreline winds both families round that of their lumen, fibre_angle from the "
                                                                       "circumference towards it either way; radial lets them lead away from it. Given: as fibre1 and fibre2, or "
                                                                       "fibre_axis. A preset artery's wind round the centreline where nothing else is said.")
                                                  .when({"hgo"})),
                         key(s.cap_viscosity, flag_field("cap_viscosity", "Lowers a viscosity that would cost more than a tenth of the "
                                                                          "stable step, and says so.")));
    }
};

/// Of a file's coordinates.
[[nodiscard]] inline FieldSpec file_unit_field() {
    std::vector<std::string_view> names;
    for (const UnitName& unit : known_units(Dimension::Length)) names.push_back(unit.name);
    return choice_field("unit", std::move(names), "Of the file's coordinates; the scene's length when absent.");
}

struct FileSurfaceKeys {
    using Struct = SurfaceSpec;
    static auto of(auto& s) {
        ValueSpec text;
        text.kind = ValueKind::Text;
        const auto repairs = repair_names();
        return described(
            {"file surface",
             "A mesh from a file: OBJ, PLY, STL, OFF, VTK, VTP, plain or .gz; of a file of tetrahedra (MSH, VTU, MEDIT, ...) its closed "
             "triangles, or else the boundary.",
             "file"},
            key(s.file,
                path_field("file", "Relative to the scene's folder; ${TROCAR_TEST_DATA} stands for that environment variable.").required()),
            custom_key(file_unit_field(), read_file_unit, s.unit),
            custom_key(value_field("groups", list_value(text, 1), "OBJ groups to keep; everything when absent."), read_groups, s.groups),
            custom_key(value_field("repair", list_value(choice_value({repairs.begin(), repairs.end()}), 0),
                                   "Named repairs, applied in this order and reported with counts. None runs unasked."),
                       read_repairs, s.repair),
            key(s.repairing.weld_tolerance, number_field("weld_tolerance", Dimension::Length, above(0.0, 0.01),
                                                         "Of the repair weld; a millionth of the mesh's size when absent.")),
            key(s.repairing.may_remove,
                number_field("may_remove", Dimension::None, between(0.0, 1.0),
                             "Share of the area, and of the enclosed volume, that one repair may take; more is an error that says how "
                             "much.")),
            key(s.repairing.may_split, flag_field("may_split", "Lets a repair leave more connected parts than it found; otherwise that is "
                                                               "an error.")),
            key(s.may_cross, flag_field("may_cross", "Lets the wall of a hollow body pass through itself: its overlaps count as inside "
                                                     "once, and its inner walls are met like any other. Otherwise that is an error.")),
            no_key(s.repairing.most_rounds, s.repairing.may_remove_key, s.repairing.may_split_key, s.source, s.shape));
    }
};

struct RecipeSurfaceKeys {
    using Struct = SurfaceSpec;
    static auto of(auto& s) {
        return described(
            {"recipe surface", "A part of a generated patient. Bodies with the same recipe belong to the same patient.", "recipe"},
            custom_key(path_field("recipe", "The recipe's file.").required(), kReadApart, s.recipe),
            custom_key(
                choice_field("part", {"liver", "lumen", "arteries"}, "Which surface of the patient; lumen and arteries are the same.")
                    .required(),
                kReadApart, s.part));
    }
};

struct AroundSurfaceKeys {
    using Struct = SurfaceSpec;
    static auto of(auto& s) {
        ValueSpec text;
        text.kind = ValueKind::Text;
        return described(
            {"around surface",
             "The free space around solids: its wall is their surfaces, seen from outside, and a box about them all. An instrument whose lumen this "
             "body is meets the solids from outside. Nothing draws it.",
             "around"},
            custom_key(value_field("around", list_value(text, 1),
                                   "Names of bodies that stand before this one, closed and not hollow: static ones, and at most one that deforms.")
                           .required(),
                       kReadApart, s.around), // once all bodies are known: resolve_around
            key(s.margin, number_field("margin", Dimension::Length, between(kSmallestLength, kLargestShape),
                                       "From the box of these bodies to the wall that closes the space.")));
    }
};
static_assert(describes_all_with<RepairOptions, FileSurfaceKeys, RecipeSurfaceKeys, AroundSurfaceKeys>);

struct ShapeKeys {
    using Struct = ShapeSpec;
    static auto of(auto& s) {
        const Range size = between(kSmallestLength, kLargestShape);
        const auto rows = [](Range radius, std::size_t most) {
            return rows_value({{"x", Dimension::Length, coordinate()},
                               {"y", Dimension::Length, coordinate()},
                               {"z", Dimension::Length, coordinate()},
                               {"radius", Dimension::Length, radius}},
                              2, most);
        };
        return described(
            {"shape surface", "A plain closed surface.", "shape", "shape"},
            key(s.kind, choice_field("shape", {"sphere", "box", "tube", "torus", "vessels"}, "Which one.").required()),
            key(s.centre, vector_field("centre", Dimension::Length, coordinate(), "Middle.").when({"sphere", "box", "torus"})),
            key(s.radius,
                number_field("radius", Dimension::Length, size, "Of a sphere; of a torus' ring.").required().when({"sphere", "torus"})),
            key(s.tube_radius,
                number_field("tube_radius", Dimension::Length, size, "Of a torus' tube, below its ring's.").required().when({"torus"})),
            key(s.extent, vector_field("extent", Dimension::Length, size, "Of a box, edge to edge.").required().when({"box"})),
            custom_key(value_field("axis", rows(size, 100000),
                                   "Of a tube with rounded ends: bends gentler than its radius, or the wall crosses itself.")
                           .required()
                           .when({"tube"}),
                       kReadApart, s.axis, s.axis_radii),
            custom_key(value_field("branches", list_value(rows(between(1e-4, 0.05), 10000), 1),
                                   "Of vessels: a smooth axis each, with radii; they melt into one another where they meet, and form one "
                                   "piece.")
                           .required()
                           .when({"vessels"}),
                       kReadApart, s.branches),
            key(s.blend,
                number_field("blend", Dimension::Length, between(0.0, 0.05), "Of vessels: width of the fillets where branches meet.")
                    .when({"vessels"})),
            key(s.triangles, count_field("triangles", 500, 1e6, "Of vessels: aimed at.").when({"vessels"})),
            key(s.subdivisions, count_field("subdivisions", 0, 7, "Of a sphere: 20 * 4^n triangles.").when({"sphere"})),
            key(s.cells, count_field("cells", 1, 500, "Of a box: squares along an edge of a face.").when({"box"})),
            key(s.sides, count_field("sides", 3, 1000, "Vertices round a tube.").when({"tube", "torus"})));
    }
};
static_assert(describes_all<ShapeKeys>);

struct MeshedCoarseKeys {
    using Struct = CoarseSpec;
    static auto of(auto& s) {
        return described(
            {"meshed coarse", "Tetrahedra made by a mesher from the simplified surface.", "mesher", "mesher"},
            key(s.mesher, choice_field<CoarseMesher>("mesher",
                                                     {{"lattice", CoarseMesher::Lattice}, {"tetgen", CoarseMesher::TetGen}, {"wall", CoarseMesher::Wall}},
                                                     "A lattice allows far longer sub-steps; TetGen, run as a program of its own, follows the "
                                                     "surface; a wall is laid around the surface of a hollow body, the lumen's.")),
            key(s.surface_triangles,
                count_field("surface_triangles", 20, 1e6, "Of the simplified surface; of a lattice's boundary, about.")),
            key(s.thickness, number_field("thickness", Dimension::Length, above(0.0, 0.1), "Of a wall, outwards from the surface.").required().when({"wall"})),
            key(s.layers, count_field("layers", 1, 16, "Of a wall, through its thickness; docs/tissue.md says what they cost and how they bend.")
                              .when({"wall"})),
            key(s.max_volume, number_field("max_volume", Dimension::Volume, above(0.0, 1.0),
                                           "Of a tetrahedron, TetGen's; follows from the surface's triangles when absent.")
                                  .when({"tetgen"})),
            key(s.may_drop, number_field("may_drop", Dimension::None, between(0.0, 1.0),
                                         "Share of the mesh's volume that may be left out as parts apart from the largest one; more is an "
                                         "error that says how much.")
                                .when({"lattice", "tetgen"})));
    }
};

inline constexpr double kLargestLabel = 2147483647.0;

/// In the map "regions": the tissue's name is its key there.
struct TissueRegionKeys {
    using Struct = TissueRegion;
    static auto of(auto& s) {
        return described({"tissue region", "The body's tissue, of another stiffness or density, in a region of its coarse mesh."},
                         key(s.label, count_field("label", -kLargestLabel, kLargestLabel,
                                                  "Of the region's cells in the array; that which the file gives the region's name when absent.")),
                         key(s.young_modulus,
                             number_field("young_modulus", Dimension::Pressure, kYoungModuli,
                                          "At small strain, whatever the law: all its moduli, and the viscosity, in proportion. The body's when absent.")),
                         key(s.density, number_field("density", Dimension::Density, kDensities, "Mass per volume; the body's when absent.")),
                         no_key(s.name));
    }
};
static_assert(describes_all<TissueRegionKeys>);

struct FileCoarseKeys {
    using Struct = CoarseSpec;
    static auto of(auto& s) {
        return described({"file coarse", "Tetrahedra from a file, in the surface's frame.", "file"},
                         key(s.file, path_field("file", "MSH, VTK, VTU, MEDIT, TetGen or Vega, plain or .gz.").required()),
                         custom_key(file_unit_field(), read_file_unit, s.unit),
                         key(s.region_array, text_field("region_array", "Array of the file's cells that says by an integer which region each belongs to: a cell array "
                                                                        "of VTK or VTU, or gmsh:physical, gmsh:geometrical, medit:ref, tetgen:ref, vega:region; the one "
                                                                        "that looks like it when absent.")),
                         key(s.fibre1_array, text_field("fibre1_array", "Array of the file's cells with three numbers each, the direction of the first family of fibres; VTK or VTU. "
                                                                           "Only where the body's law is hgo.")),
                         key(s.fibre2_array, text_field("fibre2_array", "Of the second family. One array alone is that of both.")),
                         custom_key(map_field("regions", object_value(table_of<TissueRegionKeys>()),
                                              "Regions of other tissues, by name; what is in none of them has the body's material."),
                                    read_regions, s.regions));
    }
};
static_assert(describes_all<MeshedCoarseKeys, FileCoarseKeys>);

struct DirectionRegionKeys {
    using Struct = FixedRegion;
    static auto of(auto& s) {
        return described(
            {"fixed end", "The outermost part of the body along a direction.", "direction"},
            direction_key(
                s.direction,
                vector_field("direction", Dimension::None, {}, "Towards the part that is held; its length does not matter.").required()),
            key(s.fraction, number_field("fraction", Dimension::None, above(0.0, 1.0), "Of the body's extent along it.").required()),
            no_key(s.kind));
    }
};

struct BoxRegionKeys {
    using Struct = FixedRegion;
    static auto of(auto& s) {
        return described({"fixed box", "All nodes in a box.", "box"},
                         custom_key(value_field("box",
                                                rows_value({{"x", Dimension::Length, coordinate()},
                                                            {"y", Dimension::Length, coordinate()},
                                                            {"z", Dimension::Length, coordinate()}},
                                                           2, 2),
                                                "Lower and upper corner.")
                                        .required(),
                                    read_box, s.box));
    }
};

struct BallKeys {
    using Struct = FixedRegion;
    static auto of(auto& s) {
        return described({"ball", "Centre and radius of a ball."},
                         key(s.centre, vector_field("centre", Dimension::Length, coordinate(), "Middle.").required()),
                         key(s.radius, number_field("radius", Dimension::Length, above(0.0, kLargestShape), "Of the ball.").required()));
    }
};

struct SphereRegionKeys {
    using Struct = FixedRegion;
    static auto of(auto& s) {
        return described({"fixed sphere", "All nodes in a ball.", "sphere"},
                         part_key<BallKeys>(s, object_field("sphere", table_of<BallKeys>(), "Centre and radius.").required()));
    }
};
struct PlaneKeys {
    using Struct = FixedRegion;
    static auto of(auto& s) {
        return described({"plane", "A plane, and how far from it."},
                         key(s.point, vector_field("point", Dimension::Length, coordinate(), "Of the plane.").required()),
                         direction_key(s.normal, vector_field("normal", Dimension::None, {}, "Across it; its length does not matter.").required()),
                         key(s.within, number_field("within", Dimension::Length, between(0.0, kLargestShape),
                                                    "Largest distance from the plane, on either side; 0: all nodes before it.")));
    }
};

struct PlaneRegionKeys {
    using Struct = FixedRegion;
    static auto of(auto& s) {
        return described({"fixed plane", "All nodes before a plane, where its normal points to, or near it.", "plane"},
                         part_key<PlaneKeys>(s, object_field("plane", table_of<PlaneKeys>(), "The plane.").required()));
    }
};

struct NearKeys {
    using Struct = FixedRegion;
    static auto of(auto& s) {
        return described({"near", "A body's surface, and how far from it."},
                         key(s.surface, text_field("surface", "Name of a body that stands before this one in the scene, or of this one.").required()),
                         key(s.distance, number_field("distance", Dimension::Length, above(0.0, kLargestShape), "The largest.").required()));
    }
};

struct NearRegionKeys {
    using Struct = FixedRegion;
    static auto of(auto& s) {
        return described({"fixed near", "All nodes near a body's surface at rest.", "near"},
                         part_key<NearKeys>(s, object_field("near", table_of<NearKeys>(), "Which surface, and how near.").required()));
    }
};

struct ListedRegionKeys {
    using Struct = FixedRegion;
    static auto of(auto& s) {
        return described({"fixed list", "Nodes that a file lists.", "nodes"},
                         custom_key(path_field("nodes",
                                               "Text: ids of nodes of the coarse mesh from 0 on, apart by spaces or lines; # begins a comment. "
                                               "With a coarse mesh from a file they are its own.")
                                        .required(),
                                    read_node_list, s.file, s.nodes));
    }
};
static_assert(describes_all<DirectionRegionKeys, BoxRegionKeys, BallKeys, PlaneKeys, NearKeys, ListedRegionKeys>);

/// Of a held region, beside what says where it is.
struct HeldMotionKeys {
    using Struct = HeldRegion;
    static auto of(auto& s) {
        return described(
            {"held motion", "How a held region moves."},
            custom_key(value_field("moves", displacement_rows(), "Displacement over time, linear between rows; it rests when absent."),
                       read_moves, s.moves),
            custom_key(
                value_field("turns", rows_over_time({"angle", Dimension::Angle, between(-1e6, 1e6)}),
                            "Angle over time, linear between rows, about the line through turn_point along turn_axis; before moves."),
                read_turns, s.turns),
            key(s.point, vector_field("turn_point", Dimension::Length, coordinate(), "On the line of turns, at rest.")),
            direction_key(s.axis, vector_field("turn_axis", Dimension::None, {}, "Along that line; its length does not matter.")));
    }
};

/// A region that is held and may be moved: where it is, and how.
template <class Region>
struct HeldKeys {
    using Struct = HeldRegion;
    static auto of(auto& s) {
        typename Region::Struct none{};
        const auto about = Region::of(none).about;
        return described(about, inline_keys<Region>(s.region), inline_keys<HeldMotionKeys>(s));
    }
};

[[nodiscard]] inline ValueSpec region_value() {
    return any_value({object_value(table_of<DirectionRegionKeys>()), object_value(table_of<BoxRegionKeys>()),
                      object_value(table_of<SphereRegionKeys>()), object_value(table_of<PlaneRegionKeys>()),
                      object_value(table_of<NearRegionKeys>()), object_value(table_of<ListedRegionKeys>())});
}

/// Of any load, beside what it is.
struct LoadPlaceKeys {
    using Struct = LoadSpec;
    static auto of(auto& s) {
        return described({"load place", "Where and when a load acts."},
                         custom_key(value_field("where", region_value(), "On the nodes in a region; on the whole body when absent."),
                                    read_where, s.region),
                         custom_key(value_field("over", rows_over_time({"factor", Dimension::None, between(-1e6, 1e6)}),
                                                "Factor over time, linear between rows, held before the first and after the last; in a step "
                                                "linear with the same integral and first moment, a spring's from that of its start to that of its end. 1 when absent."),
                                    read_over, s.over));
    }
};
struct ForceLoadKeys {
    using Struct = LoadSpec;
    static auto of(auto& s) {
        return described({"force load", "A force in all, shared by the nodes as by their mass.", "force"},
                         key(s.vector, vector_field("force", Dimension::Force, between(-1e6, 1e6), "In all.").required()),
                         inline_keys<LoadPlaceKeys>(s));
    }
};
struct TractionLoadKeys {
    using Struct = LoadSpec;
    static auto of(auto& s) {
        return described({"traction load", "A force per area at rest, of a direction that does not turn with the body.", "traction"},
                         key(s.vector, vector_field("traction", Dimension::Pressure, between(-1e9, 1e9),
                                                    "On the boundary's triangles whose nodes are all in the region.")
                                           .required()),
                         inline_keys<LoadPlaceKeys>(s));
    }
};
struct PressureLoadKeys {
    using Struct = LoadSpec;
    static auto of(auto& s) {
        return described({"pressure load", "A force per area as the body stands, inwards along its normals.", "pressure"},
                         key(s.number, number_field("pressure", Dimension::Pressure, between(-1e9, 1e9),
                                                    "On the boundary's triangles whose nodes are all in the region.")
                                           .required()),
                         inline_keys<LoadPlaceKeys>(s));
    }
};
struct AccelerationLoadKeys {
    using Struct = LoadSpec;
    static auto of(auto& s) {
        return described(
            {"acceleration load", "A force per mass.", "acceleration"},
            key(s.vector, vector_field("acceleration", Dimension::Acceleration, between(-1e6, 1e6), "Of every node there.").required()),
            inline_keys<LoadPlaceKeys>(s));
    }
};
struct SpringLoadKeys {
    using Struct = LoadSpec;
    static auto of(auto& s) {
        return described({"spring load", "Springs to the ground, slack where the body rests.", "spring"},
                         key(s.number, number_field("spring", Dimension::Stiffness, between(0.0, 1e9),
                                                    "Of all together, shared by the nodes as by their mass.")
                                           .required()),
                         inline_keys<LoadPlaceKeys>(s));
    }
};

struct BodyKeys {
    using Struct = SceneBody;
    static auto of(auto& s) {
        ValueSpec file;
        file.kind = ValueKind::Path;
        return described(
            {"body", "An organ, a vessel, an obstacle.", "", "kind"},
            key(s.kind, choice_field("kind", {"deformable", "static", "kinematic"},
                                     "Tissue that deforms, a surface that rests (or is carried), one that moves as told.")
                            .required()),
            custom_key(value_field("surface",
                                   any_value({file, object_value(table_of<FileSurfaceKeys>()), object_value(table_of<RecipeSurfaceKeys>()),
                                              object_value(table_of<ShapeKeys>()), object_value(table_of<AroundSurfaceKeys>())}),
                                   "The dense surface: a file's name, or an object with file, recipe, shape or around.")
                           .required(),
                       read_surface_spec, s.surface),
            key(s.scale, number_field("scale", Dimension::None, above(0.0, 1e6), "Enlarges the surface about the origin.")),
            key(s.translate, vector_field("translate", Dimension::Length, coordinate(), "Moves the surface, after the scale.")),
            key(s.hollow, flag_field("hollow", "The surface is a lumen: instruments are inside, contacts push inwards.")),
            custom_key(
                text_field("embedded_in", "Name of the deformable host body. A static surface is embedded in its mesh where it is inside; the wall of a hollow "
                                          "body that deforms, which stands before it, is joined to it there, and the host makes room for it.")
                    .when({"static", "deformable"}),
                kReadApart, s.embedded_in), // once all bodies are known: resolve_host_body
            key(s.blend, number_field("blend", Dimension::Length, above(0.0, 0.5),
                                      "With embedded_in, of a surface: over this distance outside the host the motion fades to rest; 10 mm when absent.")
                             .default_in_doc()
                             .when({"static"})),
            part_key<TissueKeys>(s, object_field("material", table_of<TissueKeys>(), "Of the tissue.").when({"deformable"})),
            custom_key(value_field("coarse",
                                   any_value({object_value(table_of<MeshedCoarseKeys>()), object_value(table_of<FileCoarseKeys>())}),
                                   "The tetrahedra that deform; a lattice's when absent.")
                           .when({"deformable"}),
                       read_coarse, s.coarse),
            key(s.spheres,
                path_field(
                    "spheres",
                    "Of a solid body: its sphere tree, a .sph file as the command prepare and the toolkit of Bradshaw and O'Sullivan "
                    "write it, in the surface's frame and the unit of its file, whatever the scene's sphere_trees. Surface that "
                    "the tree leaves out is given to the nearest leaves, which grow, and said.")),
            key(s.self_contact,
                flag_field("self_contact", "Whether the body touches itself, where the scene has that effect.").when({"deformable"})),
            custom_key(value_field("fixed",
                                   list_value(any_value({object_value(table_of<HeldKeys<DirectionRegionKeys>>()),
                                                         object_value(table_of<HeldKeys<BoxRegionKeys>>()),
                                                         object_value(table_of<HeldKeys<SphereRegionKeys>>()),
                                                         object_value(table_of<HeldKeys<PlaneRegionKeys>>()),
                                                         object_value(table_of<HeldKeys<NearRegionKeys>>()),
                                                         object_value(table_of<HeldKeys<ListedRegionKeys>>())}),
                                              0),
                                   "Regions whose nodes are held, or moved as told; none when absent.")
                           .when({"deformable"}),
                       read_fixed, s.fixed),
            custom_key(value_field(
                           "loads",
                           list_value(any_value({object_value(table_of<ForceLoadKeys>()), object_value(table_of<TractionLoadKeys>()),
                                                 object_value(table_of<PressureLoadKeys>()), object_value(table_of<AccelerationLoadKeys>()),
                                                 object_value(table_of<SpringLoadKeys>())}),
                                      0),
                           "What pulls on the body, with the effect loads; nothing when absent.")
                           .when({"deformable"}),
                       read_loads, s.loads),
            key(s.velocity,
                vector_field("velocity", Dimension::Speed, between(-1e3, 1e3), "Of all nodes at the start.").when({"deformable"})),
            key(s.spin, vector_field("spin", Dimension::AngularSpeed, between(-1e4, 1e4), "At the start, about the centre of mass.")
                            .when({"deformable"})),
            custom_key(
                value_field("motion", displacement_rows(), "Displacement over time, linear between rows.").required().when({"kinematic"}),
                read_motion, s.motion),
            no_key(s.name)); // its key in the scene's map
    }
};
static_assert(describes_all<BodyKeys, TissueKeys>);

} // namespace trocar::engine
