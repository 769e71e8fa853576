// A scene as the engine uses it: plain structs in SI, every name resolved, every number checked.
// The keys of each struct stand in the describe_*.hpp, from which reader, checks, JSON Schema and docs/scene.md are made.
#pragma once

#include "assets/anatomy/recipe.hpp"
#include "base/box.hpp"
#include "base/repair_types.hpp"
#include "base/result.hpp"
#include "base/vec.hpp"
#include "engine/scene/effect.hpp"
#include "engine/scene/settings.hpp"
#include "engine/scene/units.hpp"
#include "engine/time/limits.hpp"
#include "fem/rod/rod_design.hpp"
#include "fem/tissue/material.hpp"

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

enum class ShapeKind : std::uint8_t { Sphere, Box, Tube, Torus, Vessels };

/// A plain closed surface (assets/anatomy/shapes.hpp and vessels.hpp make it).
struct ShapeSpec {
    ShapeKind kind = ShapeKind::Sphere;
    Vec3 centre = Vec3::Zero();                  // m: sphere, box, torus
    double radius = 0.0;                         // m: sphere; torus: of the ring
    double tube_radius = 0.0;                    // m: torus
    Vec3 extent = Vec3::Zero();                  // m: box, edge to edge
    std::vector<Vec3> axis;                      // m: tube, at least 2 points; rings between the scene's rows are filled in
    std::vector<double> axis_radii;              // m: tube, one per axis point
    std::vector<anatomy::VesselBranch> branches; // vessels
    double blend = 2e-3;                         // m: vessels, width of the fillets
    std::size_t triangles = 20000;               // vessels, aimed at
    int subdivisions = 4;                        // sphere: 20 * 4^subdivisions triangles
    int cells = 8;                               // box: squares along an edge of a face
    int sides = 24;                              // tube, torus: vertices round the tube
};

enum class SurfaceSource : std::uint8_t { File, Recipe, Shape, Around };

/// Where a body's dense surface comes from. Files and recipes are known to exist.
struct SurfaceSpec {
    SurfaceSource source = SurfaceSource::Shape;
    std::filesystem::path file;      // File: the mesh; Recipe: the recipe's file
    double unit = 1.0;               // File: m per unit of the file
    std::vector<std::string> groups; // File: OBJ groups to keep; empty: everything
    std::vector<Repair> repair;      // File: named repairs, in this order
    RepairOptions repairing;         // File: the weld's tolerance, and how much a repair may take
    bool may_cross = false;          // a hollow body's wall may pass through itself
    anatomy::Recipe recipe;          // Recipe
    std::string part;                // Recipe: "liver" or "lumen"
    ShapeSpec shape;                 // Shape
    std::vector<Index> around;       // Around: solids that bound the free space, bodies before this one
    double margin = 0.05;            // Around: m, from their common box to the wall that closes the space
};

/// Tissue of the tetrahedra that a coarse mesh's file gives one label: the body's, of another stiffness or density.
struct TissueRegion {
    static constexpr std::int64_t kNoLabel = std::numeric_limits<std::int64_t>::min();
    std::string name;
    std::int64_t label = kNoLabel; // kNoLabel: that which the file gives this name
    double young_modulus = 0.0;    // Pa, at small strain: all moduli of the law and its viscosity in proportion; 0: the body's
    double density = 0.0;          // kg/m^3; 0: the body's
};

/// How tetrahedra are made of a surface: a lattice, or TetGen's mesh, fills it; a wall lies around it, of a body that is hollow.
enum class CoarseMesher : std::uint8_t { Lattice, TetGen, Wall };

/// Where a deformable body's tetrahedra come from: a mesher over the simplified surface, or a file in the surface's
/// frame.
struct CoarseSpec {
    std::filesystem::path file;          // empty: a mesher
    CoarseMesher mesher = CoarseMesher::Lattice;
    double thickness = 0.0;              // m, of a wall
    Index layers = 2;                    // of a wall, through its thickness
    double unit = 1.0;                   // m per unit of the file
    std::string region_array;            // of the file: integers by which its cells belong to regions; empty: the one that looks like it
    std::string fibre1_array, fibre2_array; // of the file: three numbers a cell, the directions of both families; empty: as the material says
    std::vector<TissueRegion> regions;   // labels that are not named have the body's material
    std::size_t surface_triangles = 800; // TetGen, wall: of the simplified surface; lattice: of its boundary, about
    double max_volume = 0.0;             // m^3, TetGen; 0: derived from the surface's triangles
    double may_drop = kUsualRemoval;     // [-] share of its volume that may be left out as parts apart from the largest one
};

enum class RegionKind : std::uint8_t { Direction, Box, Sphere, Plane, Near, Listed };

/// Coarse nodes by where they are at rest: the outermost `fraction` of the body's extent along a direction, all inside a box or sphere,
/// before a plane or near it, near a body's surface, or a list of them.
struct FixedRegion {
    RegionKind kind = RegionKind::Direction;
    Vec3 direction = Vec3::UnitZ(); // unit
    double fraction = 0.0;          // (0, 1]
    Box3 box;                       // m
    Vec3 centre = Vec3::Zero();     // m
    double radius = 0.0;            // m
    Vec3 point = Vec3::Zero();      // m, of the plane
    Vec3 normal = Vec3::UnitZ();    // unit, of the plane
    double within = 0.0;            // m, from the plane; 0: all before it
    std::string surface;            // Near: name of the body whose surface it is
    double distance = 0.0;          // m, Near: the largest
    std::filesystem::path file;     // Listed: where the ids come from
    std::vector<Index> nodes;       // Listed: ascending, each once
};

/// Displacement of a kinematic body at a time; linear between key frames, held before the first and after the last.
struct KeyFrame {
    double time = 0.0;                // s
    Vec3 displacement = Vec3::Zero(); // m
};

/// A region of nodes that are held, and how they are moved: turned first, about a line of the rest shape, then displaced.
struct HeldRegion {
    FixedRegion region;
    std::vector<KeyFrame> moves; // empty: none
    std::vector<LoadRow> turns;  // rad over time; empty: none
    Vec3 point = Vec3::Zero();   // m, of the line
    Vec3 axis = Vec3::UnitZ();   // unit
};

/// What pulls on a body from outside, with the effect loads.
struct LoadSpec {
    LoadKind kind = LoadKind::Force;
    Vec3 vector = Vec3::Zero();        // of all but pressure and spring
    double number = 0.0;               // of these
    std::optional<FixedRegion> region; // the whole body when absent
    std::vector<LoadRow> over;         // factor over time; empty: 1
};

/// How fibres lie, but for those of a file: as the material's fibre1 and fibre2 or fibre_axis say, wound round the centreline of a hollow body's lumen, or
/// away from it.
enum class FibreCourse : std::uint8_t { Given, Centreline, Radial };

enum class BodyKind : std::uint8_t { Deformable, Static, Kinematic };

struct SceneBody {
    std::string name;
    BodyKind kind = BodyKind::Static;
    SurfaceSpec surface;
    double scale = 1.0;            // applied about the origin, before translate
    Vec3 translate = Vec3::Zero(); // m
    bool hollow = false;           // the surface is a lumen: instruments are inside, contacts push inwards
    Index embedded_in = kNoIndex;  // deformable host body. Static: the surface is embedded in its mesh; Deformable and hollow, before it: the wall is joined to it
    double blend = 0.010;          // m: over this distance outside the host the motion fades to rest
    std::string preset;            // Deformable: whose tissue the material began as; empty: the defaults
    fem::Material material;        // Deformable
    FibreCourse fibre_course = FibreCourse::Given; // Deformable, of hgo
    bool cap_viscosity = true;     // Deformable: viscosity may cost a tenth of the stable step, no more
    CoarseSpec coarse;             // Deformable
    std::filesystem::path spheres; // solid bodies: the sphere tree, .sph; empty: made of the surface
    std::vector<HeldRegion> fixed; // Deformable; empty: floats freely
    std::vector<LoadSpec> loads;   // Deformable, with that effect
    Vec3 velocity = Vec3::Zero();  // m/s, Deformable: at the start
    Vec3 spin = Vec3::Zero();      // rad/s, Deformable: at the start, about its centre of mass
    bool self_contact = true;      // Deformable, with that effect
    std::vector<KeyFrame> motion;  // Kinematic, at least one
};

/// A place: a landmark of a recipe body, or a position. Landmark names are checked when the patient is generated.
struct PlaceSpec {
    std::string landmark;           // empty: position
    Index body = kNoIndex;          // the recipe body whose landmark it is
    Vec3 position = Vec3::Zero();   // m
    Vec3 direction = Vec3::UnitZ(); // unit; entries only
};

/// Such a place where it lies: of the patient that was generated.
struct Place {
    Vec3 position = Vec3::Zero();   // m
    Vec3 direction = Vec3::UnitZ(); // unit
};

struct SceneTarget {
    std::string name;
    PlaceSpec place;
};

/// Drive command: insertion and rotation at a time, linear between rows, held before the first and after the last.
struct PathPoint {
    double time = 0.0;      // s
    double insertion = 0.0; // m of rod beyond the entry
    double rotation = 0.0;  // rad of the handle
};

/// The script drives the tip to a target by itself.
struct FollowSpec {
    Index target = kNoIndex; // into Scene::targets
    FollowSettings settings;
};

/// How an instrument is computed: the implicit rod, or the mass-spring chain of Govindaraju et al. 2005.
enum class InstrumentKind : std::uint8_t { Rod, MassSpring };

/// With the effect loads.
struct TipLoad {
    Vec3 force = Vec3::Zero(); // N
    double torque = 0.0;       // N m about the tip's own axis
    std::vector<LoadRow> over; // factor; 1 when empty
};

/// What holds the last segment of a rod, and moves it: turned about its own axis, then about a line, then displaced.
struct TipClamp {
    bool slides = false;           // along its own axis it is free
    bool spins = false;            // about its own axis it is free
    std::vector<LoadRow> rotation; // rad about its own axis over time; empty: none
    std::vector<KeyFrame> moves;   // empty: none
    std::vector<LoadRow> turns;    // rad over time; empty: none
    Vec3 point = Vec3::Zero();     // m, of the line
    Vec3 axis = Vec3::UnitZ();     // unit
};

/// A ring of a tube's cross-section, from the layer inside of it, or from the bore.
struct TubeLayer {
    double outer_radius = 0.0;  // m
    double young_modulus = 0.0; // Pa
    double density = 0.0;       // kg/m^3
};

struct SceneInstrument {
    std::string name;
    std::string device; // the device that it begins as: a name of the catalogue, or a file; empty: none
    std::filesystem::path device_file; // that file, if it is one
    InstrumentKind kind = InstrumentKind::Rod;
    Index inside = kNoIndex; // a wire: the instrument before it whose bore it runs in, with whose entry and lumen
    bool play = true;        // of a wire in a bore of known radius: it rests on that one's wall
    fem::RodDesign design;
    double inner_radius = 0.0;     // m, of the bore; 0: solid
    std::vector<TubeLayer> layers; // from the inside out; empty: one material
    bool self_contact = true;           // with that effect
    bool detachable = false;            // its drive may push it wholly out of its port: then nothing holds it
    double friction = 0.05;             // Coulomb mu against every wall, with the effect friction
    double min_bend_radius = 0.0;       // m, bends tighter than this kink it; 0: not stated
    std::size_t skin_triangles = 10000; // of the dense surface, aimed at
    PlaceSpec entry;
    Index lumen = kNoIndex; // hollow body it is inside of
    double inserted = 0.0;  // m beyond the entry at t = 0
    DriveLimits limits;
    std::optional<TipLoad> tip_load;
    std::optional<TipClamp> tip_clamp;
    std::vector<PathPoint> path;      // empty: none
    std::filesystem::path path_file;  // the CSV it came from, if any
    std::optional<FollowSpec> follow; // with a path of `run --path`: what the tip is measured against
};

/// How tissue is advanced. Auto: body by body, Runge-Kutta 4, or implicitly where that would take very many sub-steps.
enum class TissueSteps : std::uint8_t { Auto, Rk4, Leapfrog, Implicit };

struct TimeSpec {
    double step = 0.01;            // s
    double duration = 0.0;         // s
    unsigned substeps = 0;         // of the tissue's integration; 0: as many as stability asks for
    unsigned max_substeps = 10000; // a scene that needs more is stopped
    TissueSteps integrator = TissueSteps::Auto;
    std::optional<PaceSpec> pace; // of `run` against the clock; none: as fast as it goes

    /// Of bodies that are advanced explicitly. With Implicit: of those that press on one another.
    [[nodiscard]] fem::Integrator explicit_rule() const noexcept {
        return integrator == TissueSteps::Leapfrog || integrator == TissueSteps::Implicit ? fem::Integrator::Leapfrog : fem::Integrator::Rk4;
    }
    /// Steps that cover the duration.
    [[nodiscard]] std::size_t step_count() const noexcept;
};

/// How `cost` compares the contacts of two runs.
struct CostSpec {
    double from = 0.0;      // s, that the exact run goes alone before anything is compared
    double patch = 0.0;     // m, edge of the cells that a surface at rest is cut into; 0: derived from the surface
    double tolerance = 0.0; // m, solids whose spheres come nearer than this are in contact; 0: the contact margin
};

/// Blood flows along the vessels that instruments move in, and takes them along.
struct BloodSpec {
    double speed = 0.2;               // m/s, at the inlet, mean over the cross-section and over time
    Blood blood;                      // its period is the pulse's, set by preparation
    std::optional<SceneTarget> inlet; // where it comes in; absent: behind the instrument's entry
};

/// What is simulated. Nothing else is.
struct Effects {
    bool elasticity = false;
    bool gravity = false;
    bool damping = false; // viscosity and mass damping of the materials
    bool coarse_contact = false;
    bool exact_contact = false;
    bool friction = false; // of instruments on walls, acting on both
    std::optional<BreathingSpec> breathing;
    std::optional<PulseSpec> pulse;
    std::optional<BloodSpec> blood_drag; // of instruments
    bool loads = false;                  // of the bodies' key loads
    bool self_contact = false;           // of deformable bodies with themselves
    bool instrument_contact = false;     // of instruments with one another
    bool twist = false;                  // of instruments: off, a turn of the handle reaches the tip at once
    bool fluoroscopy = false;            // X-ray pictures beside the shaded ones
    std::vector<AddedEffect> added;      // known by their descriptors alone: see add_effect

    /// As a scene lists them.
    [[nodiscard]] std::vector<std::string> names() const;
};

enum class PictureView : std::uint8_t { Anatomy, Tip, Fluoroscopy };

struct PictureSpec {
    PictureView view = PictureView::Anatomy;
    double time = 0.0; // s
};

/// Grey values of an X-ray frame.
enum class XrayDisplay : std::uint8_t {
    Linear,      // transmission, full scale is the open beam
    Log,         // attenuation within a window, dense is dark
    Subtraction, // attenuation added since the mask frame: what has moved, and contrast
    Roadmap,     // the attenuation's picture, over it what the mask frame's contrast filled
};

/// Of matter, at kXrayEnergy: see engine/fluoroscopy/matter.hpp.
enum class XrayMatter : std::uint8_t { Tissue, Blood, Bone, Nitinol, Steel };

/// Where a moving C-arm stands, linear between rows.
struct ArmRow {
    double time = 0.0;                     // s, ascending
    double primary = 0.0, secondary = 0.0; // rad
};

/// An X-ray source and a detector on the two ends of an arm round the isocentre. docs/fluoroscopy.md draws it.
struct XrayView {
    std::string name;
    double primary = 0.0, secondary = 0.0; // rad; + LAO, + CRA
    std::vector<ArmRow> arm;               // empty: it stands at these angles
    Vec3 isocentre = Vec3::Zero();         // m
    Vec3 table = Vec3::Zero();             // m, that the patient is moved by
    double sid = 1.05, sod = 0.75;         // m, from the source to the detector and to the isocentre
    std::array<double, 2> detector{0.3, 0.3};  // m, width and height
    std::array<unsigned, 2> pixels{512, 512};
    XrayDisplay display = XrayDisplay::Linear;
    std::optional<std::array<double, 2>> window; // [-] attenuations shown as white and as black; none: those of the first frame
    double mask = 0.0;                           // s, of the mask frame
    bool noise = false;
    double photons = 2000.0;      // of a pixel in the open beam: the dose
    double blur = 0.0;            // m, standard deviation of the detector's point spread
    double scatter = 0.0;         // [-] share of the signal that has been scattered
    double scatter_width = 0.03;  // m, standard deviation of its spread
    unsigned seed = 1;            // of the noise
    unsigned bits = 0;            // 8 or 16; 0: 16 of a linear display, 8 otherwise
    bool masks = false, depth = false, dicom = false;

    [[nodiscard]] std::size_t pixel_count() const noexcept { return std::size_t{pixels[0]} * pixels[1]; }
};

struct FluoroscopySpec {
    unsigned every = 10; // steps between frames
    std::vector<XrayView> views;
    std::vector<std::pair<std::string, XrayMatter>> matter; // of bodies and instruments by name; others have their kind's
    double shell = 1e-3;                                    // m, thickness of surfaces that are not closed
    double wall = 0.0;                                      // m, of vessels, outside of their surfaces; 0: it attenuates as what is around it
    XrayMatter wall_matter = XrayMatter::Tissue;
};

struct OutputSpec {
    std::vector<PictureSpec> pictures; // in the scene's order; a count in the scene is spread evenly over the run
    unsigned width = 1280, height = 720;
    unsigned record_every = 0; // steps between recorded states; 0: none unless the command line asks
    std::optional<PackingSpec> packing;
    std::optional<FluoroscopySpec> fluoroscopy;
};

struct ScenePosition {
    std::size_t line = 0, column = 0; // 1-based; 0: not in the file
};

struct Scene {
    std::string name;
    std::filesystem::path file;
    Units units;
    TimeSpec time;
    BudgetSpec budget;
    Vec3 gravity = Vec3::Zero(); // m/s^2
    ContactSpec contact;
    CostSpec cost;
    std::vector<SceneBody> bodies; // in the file's order, as all lists here
    std::vector<SceneInstrument> instruments;
    std::vector<SceneTarget> targets;
    Effects effects;
    OutputSpec outputs;
    std::vector<std::string> questions;                          // numbers that are allowed but unusual, for `explain` to show
    std::map<std::string, ScenePosition, std::less<>> positions; // key path, as in bodies.liver.material -> its value
    std::vector<std::string> settings;                           // POINTER=JSON, in place of what the file says: see override.hpp
};

/// Reads and checks a scene: JSON, comments allowed, names of files relative to the scene's folder.
/// "${TROCAR_TEST_DATA}" in a file name stands for that environment variable.
/// fails     with file, line, column and key: what was found and what was expected; first mistake only
[[nodiscard]] Result<Scene> read_scene(const std::filesystem::path& file);

/// The same on a text in memory; `file` is for messages and for names of files relative to it.
[[nodiscard]] Result<Scene> parse_scene(std::string_view text, const std::filesystem::path& file);

/// Paths that replace the scene's own: CSV in the scene's units, of the instruments that its header names, or of the first one;
/// checked against the instruments' lengths and limits. The scene must have an instrument. After an error some may be replaced.
/// fails     with file, line and column
[[nodiscard]] Result<void> read_instrument_paths(Scene& scene, const std::filesystem::path& csv);

/// An error about a key of a scene that was read: fills in file, line and column. For what only shows later, such as a
/// mesh that its use does not allow. Falls back to the nearest enclosing key.
[[nodiscard]] Error scene_error(const Scene& scene, std::string key, std::string message, ErrorCode code = ErrorCode::BadValue);

/// The scene's own file and all that it names: meshes, sphere trees, recipes, lists of nodes, devices, paths.
[[nodiscard]] std::vector<std::filesystem::path> files_of(const Scene& scene);

/// kNoIndex when there is none of that name.
[[nodiscard]] Index find_body(const Scene& scene, std::string_view name) noexcept;
[[nodiscard]] Index find_target(const Scene& scene, std::string_view name) noexcept;

} // namespace trocar::engine
