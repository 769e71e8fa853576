#include "targets.hpp"

#include "collision/ccd/ccd.hpp"
#include "engine/io/csv.hpp"
#include "engine/experiments/sweep/reduction.hpp"
#include "engine/experiments/sweep/result_store.hpp"
#include "engine/io/ccd_queries.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/io/formats.hpp"
#include "engine/io/frames.hpp"
#include "engine/io/path_csv.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/report/grant_record.hpp"
#include "engine/prepare/sph.hpp"
#include "engine/scene/recipe.hpp"
#include "engine/scene/scene.hpp"
#include "engine/state/bit_hash.hpp"
#include "engine/state/byte_stream.hpp"
#include "engine/step/checkpoint.hpp"
#include "engine/viewer/read_command.hpp"
#include "tests/collision/rational.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <sys/mman.h>
#include <unistd.h>

namespace trocar::fuzz {

using namespace engine;

namespace {

/// A promise is broken: libFuzzer and gtest both keep the input that led here.
void require(bool holds, const char* sentence) {
    if (holds) return;
    std::fprintf(stderr, "does not hold: %s\n", sentence);
    std::abort();
}

template <class Value>
bool is_fine(const Result<Value>& result) {
    if (result.ok()) return true;
    require(!result.error().message.empty(), "an error says what is wrong");
    require(!result.error().file.empty(), "an error names its file");
    return false;
}

const std::string kName = "fuzzed";

void check_surface(const Result<TriMesh>& mesh) {
    if (!is_fine(mesh)) return;
    require(!mesh->triangles.empty(), "a surface has a triangle");
    for (const Triangle& t : mesh->triangles)
        for (const Index v : t) require(v < mesh->vertices.size(), "every index is in range");
    for (const Vec3& v : mesh->vertices) require(is_finite(v), "every coordinate is finite");
}

/// Asks for everything that a file holds beside its tetrahedra.
struct Everything {
    BesideTets beside;
    Everything() { beside.with_arrays = true; }
};

void check_tets(const Result<TetMesh>& mesh, const BesideTets& beside) {
    if (!is_fine(mesh)) return;
    require(beside.arrays.empty() || beside.place_of_tet.size() == mesh->tets.size(), "every tetrahedron has its place in the arrays");
    require(!mesh->tets.empty(), "a mesh has a tetrahedron");
    for (const Tet& t : mesh->tets)
        for (const Index v : t) require(v < mesh->vertices.size(), "every index is in range");
    for (const Vec3& v : mesh->vertices) require(is_finite(v), "every coordinate is finite");
}

void read_obj(std::string_view bytes) {
    const auto grouped = parse_obj(bytes, kName, {});
    check_surface(grouped.ok() ? Result<TriMesh>(grouped->mesh) : Result<TriMesh>(grouped.error()));
}
void read_ply(std::string_view bytes) { check_surface(parse_ply(bytes, kName)); }
void read_stl(std::string_view bytes) { check_surface(parse_stl(bytes, kName)); }
void read_off(std::string_view bytes) { check_surface(parse_off(bytes, kName)); }
template <class Parse>
void read_tets_with(Parse&& parse) {
    Everything all;
    const Result<TetMesh> mesh = parse(&all.beside);
    check_tets(mesh, all.beside);
}
void read_msh(std::string_view bytes) {
    read_tets_with([&](BesideTets* beside) { return parse_msh(bytes, kName, beside); });
}
void read_medit(std::string_view bytes) {
    read_tets_with([&](BesideTets* beside) { return parse_medit(bytes, kName, beside); });
}
void read_veg(std::string_view bytes) {
    read_tets_with([&](BesideTets* beside) { return parse_veg(bytes, kName, beside); });
}

void check_vtk(Result<VtkMesh> vtk) {
    if (!is_fine(vtk)) return;
    check_surface(make_surface(VtkMesh(*vtk), kName));
    read_tets_with([&](BesideTets* beside) { return make_tets(std::move(*vtk), kName, beside); });
}
void read_vtk(std::string_view bytes) { check_vtk(parse_vtk_legacy(bytes, kName, true)); }
void read_vtu(std::string_view bytes) { check_vtk(parse_vtk_xml(bytes, kName, true)); }

/// Two texts, apart by the first byte 1.
void read_tetgen(std::string_view bytes) {
    const std::size_t cut = std::min(bytes.find('\x01'), bytes.size());
    read_tets_with([&](BesideTets* beside) {
        return parse_tetgen(bytes.substr(0, cut), "fuzzed.node", bytes.substr(std::min(cut + 1, bytes.size())), "fuzzed.ele", beside);
    });
}

void read_scene_text(std::string_view bytes) {
    const auto scene = parse_scene(bytes, "fuzzed.json");
    if (is_fine(scene)) require(std::isfinite(scene->time.step) && scene->time.step > 0.0, "a scene has a step");
}
void read_recipe_text(std::string_view bytes) { (void)is_fine(parse_recipe(bytes, "fuzzed.json")); }

void read_path(std::string_view bytes) {
    const auto rows = parse_path_csv(bytes, kName);
    if (!is_fine(rows)) return;
    require(!rows->empty(), "a path has a row");
    for (std::size_t k = 1; k < rows->size(); ++k) require((*rows)[k].time > (*rows)[k - 1].time, "time increases");
}

void read_ccd(std::string_view bytes) {
    const auto file = parse_ccd_queries(bytes, kName);
    if (!is_fine(file)) return;
    for (const CcdQuery& query : file->queries)
        for (const Vec3& row : query.rows) require(is_finite(row), "every coordinate is finite");
}

// Files that end with a hash of themselves: no change would ever get past it, so each is also read with a matching hash.

std::uint64_t hash_of(std::string_view bytes) {
    BitHash hash;
    hash.add_bytes(bytes);
    return hash.value();
}

void read_replay(std::string_view bytes) {
    const auto record = parse_grant_record(std::string(bytes), kName);
    const std::string body(bytes.substr(0, bytes.rfind("end ")));
    if (is_fine(record)) // the hash itself may be spelt in capitals
        require(grant_record_text(*record).starts_with(body + "end "), "a record that is read is written alike");
    const auto sealed = parse_grant_record(fmt::format("{}end {:016x}\n", body, hash_of(body)), kName);
    if (!is_fine(sealed)) return;
    const std::string written = grant_record_text(*sealed); // not always alike: numbers have several spellings
    const auto again = parse_grant_record(written, kName);
    require(again.ok() && grant_record_text(*again) == written, "what is written is read, and means the same");
}

void read_checkpoint_bytes(std::string_view bytes) {
    const auto check = [](std::string_view each) {
        const auto checkpoint = parse_checkpoint(each, kName);
        if (is_fine(checkpoint)) require(checkpoint_bytes(*checkpoint) == each, "a checkpoint that is read is written alike");
    };
    check(bytes);
    if (bytes.size() < sizeof(std::uint64_t)) return;
    std::string sealed(bytes.substr(0, bytes.size() - sizeof(std::uint64_t)));
    ByteWriter(sealed).number(hash_of(sealed));
    check(sealed);
}

/// A file in memory, for readers that want a path.
class MemoryFile {
public:
    explicit MemoryFile(std::string_view bytes) : file_(::memfd_create("fuzzed", 0)) {
        require(file_ >= 0 && ::write(file_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()), "a file in memory");
    }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    ~MemoryFile() { ::close(file_); }
    [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

private:
    int file_;
};

void read_spheres(std::string_view bytes) {
    const MemoryFile file(bytes);
    const auto tree = read_sph(file.path());
    if (!is_fine(tree)) return;
    require(tree->sphere_count() > 0, "a tree has a root");
    for (Index s = 0; s < tree->sphere_count(); ++s)
        require(tree->first_child[s] + tree->child_count[s] <= tree->sphere_count() || tree->child_count[s] == 0,
                "children are in the tree");
}

/// meta.txt, then three arrays, apart by "|": the folder of a sequence.
void read_frame_folder(std::string_view bytes) {
    static const std::filesystem::path folder = std::filesystem::temp_directory_path() / ("trocar-fuzz-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    for (const char* name : {"meta.txt", "tris.i32", "obj.i32", "pos.f64"}) {
        const std::size_t cut = std::min(bytes.find('|'), bytes.size());
        const std::string_view part = std::string_view(name) == "pos.f64" ? bytes : bytes.substr(0, cut);
        std::ofstream(folder / name, std::ios::binary).write(part.data(), static_cast<std::streamsize>(part.size()));
        bytes.remove_prefix(std::min(cut + 1, bytes.size()));
    }
    const auto frames = read_frames(folder);
    if (is_fine(frames)) require(frames->positions.size() == frames->frame_count * frames->vertex_count(), "every frame is there");
    std::filesystem::remove_all(folder);
}

void read_sweep_text(std::string_view bytes) {
    const auto spec = parse_sweep(bytes, "/nowhere/fuzzed.json");
    if (!is_fine(spec)) return;
    std::uint64_t runs = spec->scenes.size() * spec->repeat;
    for (const SweepAxis& axis : spec->axes) {
        runs *= axis.values.size();
        require(axis.pointers.size() == axis.pointer_at.size(), "every pointer has its place");
        for (const auto& values : axis.values) require(values.size() == axis.pointers.size(), "every pointer has a value in every row");
    }
    require(runs > 0 && runs <= kMostRuns, "a sweep has a bounded number of runs");
}

void read_plan_text(std::string_view bytes) {
    const auto plan = parse_plan(bytes, kName);
    if (!is_fine(plan)) return;
    for (const std::uint64_t number : {std::uint64_t{0}, plan->run_count() / 2, plan->run_count() - 1}) {
        const PlannedRun run = plan->run(number);
        require(run.scene < plan->scenes.size() && run.key.size() == 32, "a run has a scene and a key");
        (void)plan->command_line(run, "out");
        (void)plan->describe(run);
    }
    require(plan->chunk(plan->chunk_count() - 1).second == plan->run_count(), "chunks hold every run");
    const std::string text = plan->text();
    const auto again = parse_plan(text, kName);
    require(again.ok() && again->text() == text && again->run(0).key == plan->run(0).key, "a plan that is written is read alike");
}

/// A line of results, as it is and with the checksum that fits.
void read_result_line(std::string_view bytes) {
    const auto check = [](std::string_view line) {
        const auto result = parse_result_line(line);
        if (!result) return;
        std::string again = result_line(*result);
        require(again.ends_with('\n') && again.find('\n') == again.size() - 1, "a result is one line");
        again.pop_back();
        const auto read = parse_result_line(again);
        require(read && read->run == result->run && read->key == result->key && read->status == result->status && read->values == result->values,
                "a result that is written is read alike");
    };
    check(bytes);
    BitHash hash;
    const std::string_view text = bytes.substr(std::min<std::size_t>(bytes.size(), 17));
    hash.add_text(text);
    check(fmt::format("{:016x} {}", hash.value(), text));
}

void read_csv_text(std::string_view bytes) {
    std::string text;
    const auto rows = read_csv(bytes);
    for (const CsvRow& row : rows) {
        require(!row.cells.empty(), "a row has a cell");
        for (std::size_t i = 0; i < row.cells.size(); ++i) text += (i > 0 ? "," : "") + csv_cell(row.cells[i]);
        text += '\n';
        (void)column_values(bytes, row.cells.front());
    }
    const auto again = read_csv(text);
    require(again.size() == rows.size(), "rows that are written are read");
    for (std::size_t k = 0; k < rows.size(); ++k) require(again[k].cells == rows[k].cells, "cells that are written are read alike");
}

/// Messages of the page, or of any client that has the token.
void read_message(std::string_view bytes) {
    const viewer::CommandRange range{{100, 20}, {true, false}};
    const auto request = viewer::read_request(bytes, range);
    if (!request.ok()) {
        require(!request.error().message.empty(), "an error says what is wrong");
        return;
    }
    const auto* command = std::get_if<viewer::Command>(&*request);
    if (command == nullptr) return;
    if (const auto* drive = std::get_if<viewer::Drive>(command))
        require(std::abs(drive->insertion) <= 1.0 && std::abs(drive->rotation) <= 1.0, "a drive command is no faster than its limits");
    if (const auto* grab = std::get_if<viewer::Grab>(command))
        require(grab->body == 0 && grab->vertex < 100 && is_finite(grab->target), "what is pulled exists, and may be pulled");
    if (const auto* pace = std::get_if<viewer::Pace>(command))
        require(pace->factor >= viewer::kSlowestPace && pace->factor <= 1.0, "a pace is in its range");
}

void unfold(std::string_view bytes) {
    const auto text = inflate_bytes(std::string(bytes), max_unfolded_bytes(bytes.size()));
    if (text.ok()) require(text->size() <= max_unfolded_bytes(bytes.size()), "unfolding is bounded");
}

// The elementary tests: four moving points. The first byte chooses the kind and how coordinates are made; grids make most pairs touch
// at a corner, in a plane, or begin in contact; raw bits reach every exponent that a scene may have.

struct Bytes {
    std::string_view left;
    std::uint64_t next(std::size_t count) {
        std::uint64_t value = 0;
        for (std::size_t k = 0; k < count; ++k) {
            value = value << 8 | (left.empty() ? 0u : static_cast<unsigned char>(left.front()));
            if (!left.empty()) left.remove_prefix(1);
        }
        return value;
    }
};

double coordinate(Bytes& bytes, unsigned way) {
    const std::uint64_t bits = bytes.next(way == 0 ? 1 : way == 1 ? 2 : 8);
    if (way == 0) return static_cast<double>(bits % 7);
    if (way == 1) return static_cast<double>(static_cast<std::int64_t>(bits % 9) - 4) + 0x1p-40 * static_cast<double>(bits / 9 % 5);
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof value);
    if (!std::isfinite(value)) return 0.0;
    if (value == 0.0) return 0.0;
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    return std::ldexp(mantissa, exponent % (way == 2 ? 30 : 3)); // 1e-9 to 1e9, or all of one size
}

void meet_rationally(std::string_view input) {
    Bytes bytes{input};
    const auto head = static_cast<unsigned>(bytes.next(1));
    const bool vertex_face = (head & 1) != 0;
    std::array<collision::SweptPoint, 4> p;
    for (collision::SweptPoint& q : p)
        for (int axis = 0; axis < 3; ++axis) {
            q.t0[axis] = coordinate(bytes, head >> 1 & 3);
            q.t1[axis] = (head & 8) != 0 && bytes.next(1) % 2 == 0 ? q.t0[axis] : coordinate(bytes, head >> 1 & 3);
        }
    const auto ccd =
        vertex_face ? collision::ccd_vertex_face(p[0], {p[1], p[2], p[3]}) : collision::ccd_edge_edge({p[0], p[1]}, {p[2], p[3]});
    const auto swept = vertex_face ? collision::sweep_vertex_face(p[0], {p[1], p[2], p[3]}, {})
                                   : collision::sweep_edge_edge({p[0], p[1]}, {p[2], p[3]}, {});
    require(!ccd.meets || swept.hit(), "the conservative test never says apart where the exact one finds a contact");
    require(ccd.time >= 0.0 && ccd.time <= 1.0 && is_finite(ccd.normal), "time and normal are numbers");
    const auto verdict = collision::testing::RationalPair(vertex_face, p).verdict();
    if (verdict == collision::testing::Verdict::Unknown) return; // the plain arithmetic gives up on close irrational roots
    require(ccd.meets == (verdict == collision::testing::Verdict::Meets), "the exact test says what rational arithmetic says");
}

constexpr Target kTargets[] = {
    {"obj", read_obj, 4096},
    {"ply", read_ply, 4096},
    {"stl", read_stl, 4096},
    {"off", read_off, 4096},
    {"msh", read_msh, 4096},
    {"medit", read_medit, 4096},
    {"veg", read_veg, 4096},
    {"tetgen", read_tetgen, 4096},
    {"vtk", read_vtk, 4096},
    {"vtu", read_vtu, 8192},
    {"scene", read_scene_text, 8192},
    {"recipe", read_recipe_text, 2048},
    {"path", read_path, 2048},
    {"ccd", read_ccd, 4096},
    {"replay", read_replay, 4096},
    {"checkpoint", read_checkpoint_bytes, 8192},
    {"sph", read_spheres, 2048},
    {"frames", read_frame_folder, 2048},
    {"gzip", unfold, 4096},
    {"sweep", read_sweep_text, 4096},
    {"plan", read_plan_text, 4096},
    {"result", read_result_line, 2048},
    {"rows", read_csv_text, 2048},
    {"message", read_message, 2048},
    {"meeting", meet_rationally, 256},
};

} // namespace

std::span<const Target> targets() { return kTargets; }

} // namespace trocar::fuzz
