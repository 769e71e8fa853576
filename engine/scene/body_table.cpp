#include "engine/scene/scene_table.hpp"

#include "engine/scene/scene.hpp"

namespace trocar::engine {
namespace {

constexpr double kLargestBody = 10.0;    // m
constexpr double kSmallestLength = 1e-5; // m

std::vector<std::string_view> length_units() {
    std::vector<std::string_view> names;
    for (const UnitName& unit : known_units(Dimension::Length)) names.push_back(unit.name);
    return names;
}

FieldSpec file_unit_field() { return choice_field("unit", length_units(), "Of the file's coordinates; the scene's length when absent."); }

const ObjectSpec& material_table() {
    static const fem::Material usual{};
    static const ObjectSpec table{
        "material",
        "Isotropic tissue. The defaults are a soft liver.",
        "",
        "",
        {
            choice_field("law", {"neo_hookean", "corotational", "stvk"},
                         "Stable neo-Hookean, corotational linear, or St. Venant-Kirchhoff.")
                .by_default(std::string_view("neo_hookean")),
            number_field("young_modulus", Dimension::Pressure,
                         {10.0, 3e10, false, 100.0, 1e8, "soft tissue is 0.1 kPa to 100 MPa, bone up to 30 GPa"}, "Stiffness.")
                .by_default(usual.young_modulus),
            number_field(
                "poisson_ratio", Dimension::None,
                {0.0, 0.4999, false, 0.0, fem::kLockingPoissonRatio, "above 0.45 linear tetrahedra lock: they bend far too little"},
                "0 compressible, 0.5 incompressible.")
                .by_default(usual.poisson_ratio),
            number_field("density", Dimension::Density,
                         {50.0, 23000.0, false, 200.0, 2500.0, "soft tissue is 900 to 1200 kg/m^3, lung from 200, bone up to 2000"},
                         "Mass per volume.")
                .by_default(usual.density),
            number_field("viscosity", Dimension::Viscosity,
                         {0.0, 1e5, false, 0.0, 1e3, "on the strain rate; large values shrink the stable step"},
                         "Damps deformation: adds the stress 2 viscosity D, with D the rate of strain, see docs/tissue.md.")
                .by_default(usual.viscosity),
            number_field("mass_damping", Dimension::Rate, {0.0, 1e4, false, 0.0, 1e3, "drags every node towards rest"},
                         "Damps all motion, free flight too: adds the acceleration -mass_damping v, see docs/tissue.md.")
                .by_default(usual.mass_damping),
            flag_field("cap_viscosity", "Lowers a viscosity that would cost more than a tenth of the stable step, and says so.")
                .by_default(true),
        }};
    return table;
}

const ObjectSpec& file_surface_table() {
    static const ObjectSpec table = [] {
        const auto names = repair_names();
        ValueSpec text;
        text.kind = ValueKind::Text;
        return ObjectSpec{
            "file surface",
            "A mesh from a file: OBJ, PLY, STL, OFF, VTK, VTP, plain or .gz; of a file of tetrahedra (MSH, VTU, MEDIT, ...) the boundary.",
            "file",
            "",
            {
                path_field("file", "Relative to the scene's folder; ${TROCAR_TEST_DATA} stands for that environment variable.").required(),
                file_unit_field(),
                value_field("groups", list_value(text, 1), "OBJ groups to keep; everything when absent."),
                value_field("repair", list_value(choice_value({names.begin(), names.end()}), 0),
                            "Named repairs, applied in this order and reported with counts. None runs unasked."),
                number_field("weld_tolerance", Dimension::Length, above(0.0, 0.01),
                             "Of the repair weld; a millionth of the mesh's size when absent."),
                number_field(
                    "may_remove", Dimension::None, between(0.0, 1.0),
                    "Share of the area, and of the enclosed volume, that one repair may take; more is an error that says how much.")
                    .by_default(kUsualRemoval),
                flag_field("may_split", "Lets a repair leave more connected parts than it found; otherwise that is an error.")
                    .by_default(false),
                flag_field("may_cross", "Lets the wall of a hollow body pass through itself: its overlaps count as inside once, and its "
                                        "inner walls are met like any other. Otherwise that is an error.")
                    .by_default(false),
            }};
    }();
    return table;
}

const ObjectSpec& recipe_surface_table() {
    static const ObjectSpec table{
        "recipe surface",
        "A part of a generated patient. Bodies with the same recipe belong to the same patient.",
        "recipe",
        "",
        {
            path_field("recipe", "The recipe's file.").required(),
            choice_field("part", {"liver", "lumen", "arteries"}, "Which surface of the patient; lumen and arteries are the same.")
                .required(),
        }};
    return table;
}

const ObjectSpec& shape_surface_table() {
    static const ShapeSpec usual{};
    static const ObjectSpec table{
        "shape surface",
        "A plain closed surface.",
        "shape",
        "shape",
        {
            choice_field("shape", {"sphere", "box", "tube", "torus", "vessels"}, "Which one.").required(),
            vector_field("centre", Dimension::Length, coordinate(), "Middle.").by_default(usual.centre).when({"sphere", "box", "torus"}),
            number_field("radius", Dimension::Length, between(kSmallestLength, kLargestBody), "Of a sphere; of a torus' ring.")
                .required()
                .when({"sphere", "torus"}),
            number_field("tube_radius", Dimension::Length, between(kSmallestLength, kLargestBody), "Of a torus' tube, below its ring's.")
                .required()
                .when({"torus"}),
            vector_field("extent", Dimension::Length, between(kSmallestLength, kLargestBody), "Of a box, edge to edge.")
                .required()
                .when({"box"}),
            value_field("axis",
                        rows_value({{"x", Dimension::Length, coordinate()},
                                    {"y", Dimension::Length, coordinate()},
                                    {"z", Dimension::Length, coordinate()},
                                    {"radius", Dimension::Length, between(kSmallestLength, kLargestBody)}},
                                   2, 100000),
                        "Of a tube with rounded ends: bends gentler than its radius, or the wall crosses itself.")
                .required()
                .when({"tube"}),
            value_field("branches",
                        list_value(rows_value({{"x", Dimension::Length, coordinate()},
                                               {"y", Dimension::Length, coordinate()},
                                               {"z", Dimension::Length, coordinate()},
                                               {"radius", Dimension::Length, between(1e-4, 0.05)}},
                                              2, 10000),
                                   1),
                        "Of vessels: a smooth axis each, with radii; they melt into one another where they meet, and form one piece.")
                .required()
                .when({"vessels"}),
            number_field("blend", Dimension::Length, between(0.0, 0.05), "Of vessels: width of the fillets where branches meet.")
                .by_default(usual.blend)
                .when({"vessels"}),
            count_field("triangles", 500, 1e6, "Of vessels: aimed at.").by_default(double(usual.triangles)).when({"vessels"}),
            count_field("subdivisions", 0, 7, "Of a sphere: 20 * 4^n triangles.").by_default(double(usual.subdivisions)).when({"sphere"}),
            count_field("cells", 1, 500, "Of a box: squares along an edge of a face.").by_default(double(usual.cells)).when({"box"}),
            count_field("sides", 3, 1000, "Vertices round a tube.").by_default(double(usual.sides)).when({"tube", "torus"}),
        }};
    return table;
}

const ObjectSpec& meshed_coarse_table() {
    static const CoarseSpec usual{};
    static const ObjectSpec table{
        "meshed coarse",
        "Tetrahedra made by a mesher from the simplified surface.",
        "mesher",
        "",
        {
            choice_field("mesher", {"lattice", "tetgen"},
                         "A lattice allows far longer sub-steps; TetGen, run as a program of its own, follows the surface.")
                .by_default(std::string_view("lattice")),
            count_field("surface_triangles", 20, 1e6, "Of the simplified surface; of a lattice's boundary, about.")
                .by_default(double(usual.surface_triangles)),
            number_field("max_volume", Dimension::Volume, above(0.0, 1.0),
                         "Of a tetrahedron, TetGen's; follows from the surface's triangles when absent."),
        }};
    return table;
}

const ObjectSpec& file_coarse_table() {
    static const ObjectSpec table{"file coarse",
                                  "Tetrahedra from a file, in the surface's frame.",
                                  "file",
                                  "",
                                  {
                                      path_field("file", "MSH, VTK, VTU, MEDIT, TetGen or Vega, plain or .gz.").required(),
                                      file_unit_field(),
                                  }};
    return table;
}

const ObjectSpec& direction_region_table() {
    static const ObjectSpec table{
        "fixed end",
        "The outermost part of the body along a direction.",
        "direction",
        "",
        {
            vector_field("direction", Dimension::None, {}, "Towards the part that is held; its length does not matter.").required(),
            number_field("fraction", Dimension::None, above(0.0, 1.0), "Of the body's extent along it.").required(),
        }};
    return table;
}

const ObjectSpec& box_region_table() {
    static const ObjectSpec table{"fixed box",
                                  "All nodes in a box.",
                                  "box",
                                  "",
                                  {
                                      value_field("box",
                                                  rows_value({{"x", Dimension::Length, coordinate()},
                                                              {"y", Dimension::Length, coordinate()},
                                                              {"z", Dimension::Length, coordinate()}},
                                                             2, 2),
                                                  "Lower and upper corner.")
                                          .required(),
                                  }};
    return table;
}

const ObjectSpec& ball_table() {
    static const ObjectSpec table{"ball",
                                  "Centre and radius of a ball.",
                                  "",
                                  "",
                                  {
                                      vector_field("centre", Dimension::Length, coordinate(), "Middle.").required(),
                                      number_field("radius", Dimension::Length, above(0.0, kLargestBody), "Of the ball.").required(),
                                  }};
    return table;
}

const ObjectSpec& sphere_region_table() {
    static const ObjectSpec table{
        "fixed sphere", "All nodes in a ball.", "sphere", "", {object_field("sphere", ball_table(), "Centre and radius.").required()}};
    return table;
}

ValueSpec surface_value() {
    ValueSpec file;
    file.kind = ValueKind::Path;
    return any_value({file, object_value(file_surface_table()), object_value(recipe_surface_table()), object_value(shape_surface_table())});
}

} // namespace

const ObjectSpec& body_table() {
    static const SceneBody usual{};
    static const std::vector<Column> motion = {{"t", Dimension::Time, between(0.0, 1e6)},
                                               {"x", Dimension::Length, coordinate()},
                                               {"y", Dimension::Length, coordinate()},
                                               {"z", Dimension::Length, coordinate()}};
    static const ObjectSpec table{
        "body",
        "An organ, a vessel, an obstacle.",
        "",
        "kind",
        {
            choice_field("kind", {"deformable", "static", "kinematic"},
                         "Tissue that deforms, a surface that rests (or is carried), one that moves as told.")
                .required(),
            value_field("surface", surface_value(), "The dense surface: a file's name, or an object with file, recipe or shape.")
                .required(),
            number_field("scale", Dimension::None, above(0.0, 1e6), "Enlarges the surface about the origin.").by_default(usual.scale),
            vector_field("translate", Dimension::Length, coordinate(), "Moves the surface, after the scale.").by_default(usual.translate),
            flag_field("hollow", "The surface is a lumen: instruments are inside, contacts push inwards.").by_default(usual.hollow),
            text_field("embedded_in", "Name of the deformable host body, in whose mesh this surface is embedded where it is inside.")
                .when({"static"}),
            number_field("blend", Dimension::Length, above(0.0, 0.5),
                         "With embedded_in: over this distance outside the host the motion fades to rest; 10 mm when absent.")
                .when({"static"}),
            object_field("material", material_table(), "Of the tissue.").when({"deformable"}),
            value_field("coarse", any_value({object_value(meshed_coarse_table()), object_value(file_coarse_table())}),
                        "The tetrahedra that deform; a lattice's when absent.")
                .when({"deformable"}),
            flag_field("self_contact", "Whether the body touches itself, where the scene has that effect.")
                .by_default(true)
                .when({"deformable"}),
            value_field("fixed",
                        list_value(any_value({object_value(direction_region_table()), object_value(box_region_table()),
                                              object_value(sphere_region_table())}),
                                   0),
                        "Regions whose nodes are held; none when absent.")
                .when({"deformable"}),
            value_field("motion", rows_value(motion, 1, 1000000), "Displacement over time, linear between rows.")
                .required()
                .when({"kinematic"}),
        }};
    return table;
}

} // namespace trocar::engine
