// A small project of its own, against the installed package alone: surfaces, and of two shipped scenes steps, steps by hand, contacts,
// positions, forks, states that are kept and checkpoints. It fails where one of them is not as it says.
#include <trocar.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace sim = trocar::engine;
using trocar::Vec3;

namespace {

int failures = 0, checks = 0;

void expect(bool holds, const char* what) {
    ++checks;
    if (holds) return;
    ++failures;
    std::fprintf(stderr, "does not hold: %s\n", what);
}

bool all_finite(std::span<const Vec3> points) {
    for (const Vec3& p : points)
        if (!trocar::is_finite(p)) return false;
    return !points.empty();
}

/// Towards an insertion and a rotation of the first instrument; without one as the scene says.
void steps(sim::Simulator& simulator, int count, double insertion = 0.0, double rotation = 0.0) {
    sim::Inputs inputs;
    inputs.drive.resize(simulator.instrument_count());
    if (!inputs.drive.empty()) inputs.drive[0] = sim::DriveCommand{.insertion = insertion, .rotation = rotation};
    for (int k = 0; k < count; ++k)
        if (const auto taken = simulator.step(inputs); !taken) return expect(false, taken.error().to_string().c_str());
    expect(simulator.report().finite, "the state stays finite");
}

/// The simulator shares what was prepared: it goes on when that is gone.
std::optional<sim::Simulator> load(const std::filesystem::path& file) {
    auto scene = sim::read_scene(file);
    if (!scene) return expect(false, scene.error().to_string().c_str()), std::nullopt;
    scene->budget.limits = sim::parse_budget("work:20000")->limits; // counts tests instead of time: the same bits on every machine
    const auto prepared = sim::prepare_scene(*scene);
    if (!prepared) return expect(false, prepared.error().to_string().c_str()), std::nullopt;
    expect(prepared->bodies().size() == scene->bodies.size() && prepared->bodies()[0].name == scene->bodies[0].name,
           "a summary for every body");
    return sim::Simulator(*prepared);
}

/// From any state: forks, kept states and checkpoints go on to the same bits.
void check_copies(sim::Simulator& simulator, const std::filesystem::path& folder) {
    const std::uint64_t here = simulator.hash();
    expect(here == sim::hash_state(simulator.state()), "a simulator's hash is its state's");
    sim::Simulator fork = simulator.fork();
    const sim::SavedState saved = simulator.save();
    const std::filesystem::path file = folder / "state.checkpoint";
    expect(sim::write_checkpoint(file, sim::make_checkpoint(simulator)).ok(), "a checkpoint is written");
    expect(fork.hash() == here, "a fork starts where it was made");
    expect(fork.contacts().size() == simulator.contacts().size(), "and with the contacts that are there");

    steps(simulator, 15, 0.2, 1.0);
    const std::uint64_t there = simulator.hash();
    expect(there != here, "steps change the state");
    expect(fork.hash() == here, "and not that of a fork");
    steps(fork, 15, 0.2, 1.0);
    expect(fork.hash() == there, "a fork goes on to the same bits");

    expect(fork.restore(*saved).ok() && fork.hash() == here, "a kept state comes back");
    steps(fork, 15, 0.2, 1.0);
    expect(fork.hash() == there, "and goes on to the same bits");

    const auto checkpoint = sim::read_checkpoint(file);
    if (!checkpoint) return expect(false, checkpoint.error().to_string().c_str());
    sim::Simulator resumed(simulator, simulator.budget());
    expect(resumed.hash() != here, "another simulator starts at the scene's start");
    expect(sim::resume(resumed, *checkpoint, file).ok() && resumed.hash() == here, "a checkpoint comes back");
    steps(resumed, 15, 0.2, 1.0);
    expect(resumed.hash() == there, "and goes on to the same bits");
}

void drive_a_catheter(const std::filesystem::path& scenes, const std::filesystem::path& folder) {
    auto simulator = load(scenes / "u_bend.json");
    if (!simulator) return;
    const auto catheter = simulator->find_instrument("catheter"), vessel = simulator->find_body("vessel");
    expect(catheter && vessel && !simulator->find_body("catheter"), "bodies and instruments are found by their names");
    if (!catheter || !vessel) return;

    simulator->step(); // as the script says
    const double start = simulator->instrument(*catheter).insertion;
    steps(*simulator, 450, 0.15, 0.5); // into the bend
    const sim::InstrumentView view = simulator->instrument(*catheter);
    expect(view.insertion > start && view.insertion <= 0.15 && view.rotation > 0.0,
           "a drive command moves the handle, no faster than its limits");
    expect(all_finite(view.rod) && all_finite(view.skin) && !view.skin_triangles.empty(), "rod and skin are there");
    expect(view.tip() == simulator->report().tip && view.insertion == simulator->report().insertion_m, "the report says the same");
    expect(view.tip().z() > 100e-3 && view.tip().z() < 135e-3 && std::abs(view.tip().y()) < 5e-3 && view.tip().x() > 0.0,
           "the tip lies in the bend");

    const sim::BodyView wall = simulator->body(*vessel);
    expect(wall.name == "vessel" && all_finite(wall.surface) && wall.nodes.empty(), "the wall has a surface and no tissue");
    expect(!simulator->contacts().empty() && simulator->report().contact_force_n > 0.0, "in the bend it presses on the wall");
    for (const trocar::Contact& contact : simulator->contacts()) {
        double nearest = 1.0;
        for (const Vec3& vertex : wall.surface) nearest = std::min(nearest, (vertex - contact.point).norm());
        expect(nearest < 2e-3, "contacts lie at the wall");
        expect(std::abs(contact.normal.norm() - 1.0) < 1e-9, "their normals are unit vectors");
    }
    for (const trocar::Triangle& triangle : wall.triangles)
        for (const trocar::Index vertex : triangle)
            if (vertex >= wall.surface.size()) return expect(false, "triangles name vertices of the surface");

    expect(simulator->body(simulator->body_count()).surface.empty() && simulator->instrument(simulator->instrument_count()).rod.empty(),
           "of what there is not, nothing is shown");
    const std::uint64_t before = simulator->hash();
    sim::Inputs wrong;
    wrong.drive = {sim::DriveCommand{.insertion = std::numeric_limits<double>::quiet_NaN(), .rotation = 0.0}};
    expect(!simulator->step(wrong).ok() && simulator->hash() == before, "what is not finite is refused, and then nothing has changed");
    check_copies(*simulator, folder);
    std::printf("%zu rod nodes, %zu contacts\n", simulator->instrument(*catheter).rod.size(), simulator->contacts().size());
}

void drop_a_ball(const std::filesystem::path& scenes, const std::filesystem::path& folder) {
    auto simulator = load(scenes / "falling_sphere.json");
    if (!simulator) return;
    std::optional<std::size_t> soft;
    for (std::size_t i = 0; i < simulator->body_count(); ++i)
        if (!simulator->body(i).nodes.empty()) soft = i;
    expect(soft.has_value() && simulator->instrument_count() == 0, "a body has tissue, and there is no instrument");
    if (!soft) return;
    const std::vector<Vec3> rest(simulator->body(*soft).surface.begin(), simulator->body(*soft).surface.end());
    steps(*simulator, 20);
    const sim::BodyView ball = simulator->body(*soft);
    expect(ball.surface.size() == rest.size() && all_finite(ball.surface) && ball.surface[0].z() < rest[0].z(), "it falls");
    expect(ball.node_velocity.size() == ball.nodes.size(), "its nodes have velocities");
    check_copies(*simulator, folder);
}

void write_and_read_a_surface(const std::filesystem::path& folder) {
    const trocar::TriMesh tetrahedron{.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                      .triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
    const std::filesystem::path path = folder / "tetrahedron.vtp";
    expect(sim::write_vtp(path, tetrahedron).ok(), "a surface is written");
    const auto mesh = sim::read_surface(path);
    expect(mesh.ok() && mesh->triangles.size() == 4 && trocar::inspect_surface(*mesh).closed(), "and read: closed, of 4 triangles");
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 3) return std::fprintf(stderr, "usage: consumer SCENES FOLDER\n"), 2;
    const auto missing = sim::read_scene("there_is_no_such.json");
    expect(!missing && missing.error().code == trocar::ErrorCode::FileNotFound, "a scene that is not there is an error with its reason");
    write_and_read_a_surface(argv[2]);
    drive_a_catheter(argv[1], argv[2]);
    drop_a_ball(argv[1], argv[2]);
    std::printf("%d of %d hold\n", checks - failures, checks);
    return failures == 0 ? 0 : 1;
}
