// A run that is cut and goes on from a checkpoint is the run that was never cut: every bit of what decides the next step, in every
// step after the cut. And a checkpoint that is not this scene's, cut off, or changed is refused.
#include "engine/io/write_mesh.hpp"
#include "engine/state/byte_stream.hpp"
#include "engine/state/state_bytes.hpp"
#include "engine/step/checkpoint.hpp"
#include "step_fixture.hpp"

#include <gmock/gmock.h>

#include <array>
#include <filesystem>
#include <map>
#include <ostream>
#include <random>

namespace trocar::engine {
namespace {

std::uint64_t memory_hash(Simulator& simulator) { return hash_whole_state(simulator.state()); }

struct SceneCase {
    std::string name, text;
    std::uint64_t steps = 60;
    std::vector<std::uint64_t> cuts{1, 17, 40};
};
std::ostream& operator<<(std::ostream& os, const SceneCase& c) { return os << c.name; }

/// A ball falls on a slab that bends; a second ball hangs above, to be dropped on the first.
std::string heap(const std::string& budget, const std::string& contact) {
    const auto ball = [](const char* name, double z) {
        return fmt::format(R"("{}": {{"kind": "deformable", "surface": {{"shape": "sphere", "centre": [2, 1, {}], "radius": 15,
            "subdivisions": 2}}, "coarse": {{"mesher": "lattice", "surface_triangles": 120}},
            "material": {{"young_modulus": 30, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.005, "mass_damping": 2}}}})",
                           name, z);
    };
    return fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.005, "duration": 10}}, "budget": "{}",
        "gravity": [0, 0, -9810], "contact": {{{}"solid_friction": 0.3, "solid_damping": 0.02}}, "bodies": {{{}, {},
        "table": {{"kind": "static", "surface": {{"shape": "box", "centre": [0, 0, -20], "extent": [90, 90, 40], "cells": 5}}}}}},
        "effects": ["elasticity", "gravity", "damping", "coarse_contact", "friction"]}})",
                       budget, contact, ball("first", 17.0), ball("second", 49.0));
}

/// A U of cubes that lies on its side, legs and slot of 8 mm: the upper leg falls on the lower one.
std::string clasp() {
    const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "clasp.obj";
    using Cell = std::array<int, 3>;
    const auto is_full = [](const Cell& c) {
        return c[0] >= 0 && c[0] < 12 && c[1] >= 0 && c[1] < 2 && c[2] >= 0 && c[2] < 6 && (c[0] < 3 || c[2] < 2 || c[2] >= 4);
    };
    TriMesh mesh;
    std::map<Cell, Index> corners;
    const auto corner = [&](const Cell& c) {
        const auto [place, added] = corners.try_emplace(c, static_cast<Index>(mesh.vertices.size()));
        if (added) mesh.vertices.push_back(4e-3 * Vec3(c[0], c[1], c[2]));
        return place->second;
    };
    for (int i = 0; i < 12; ++i)
        for (int j = 0; j < 2; ++j)
            for (int k = 0; k < 6; ++k)
                for (std::size_t axis = 0; axis < 3; ++axis)
                    for (const int side : {0, 1}) {
                        Cell at{i, j, k}, beside = at;
                        beside[axis] += side == 1 ? 1 : -1;
                        if (!is_full(at) || is_full(beside)) continue;
                        std::array<Index, 4> quad{};
                        for (std::size_t q = 0; q < 4; ++q) {
                            Cell c = at;
                            c[axis] += side;
                            c[(axis + 1) % 3] += q == 1 || q == 2 ? 1 : 0;
                            c[(axis + 2) % 3] += q >= 2 ? 1 : 0;
                            quad[q] = corner(c);
                        }
                        if (side == 0) std::swap(quad[1], quad[3]);
                        mesh.triangles.push_back({quad[0], quad[1], quad[2]});
                        mesh.triangles.push_back({quad[0], quad[2], quad[3]});
                    }
    EXPECT_TRUE(write_obj(file, mesh).ok());
    return fmt::format(R"({{"units": {{"length": "m", "pressure": "kPa"}}, "time": {{"step": 0.005, "duration": 2}}, "budget": "work:300000",
        "gravity": [0, 0, -30], "contact": {{"solid_stiffness": 50, "solid_damping": 0.05}}, "bodies": {{"clasp": {{"kind": "deformable",
        "surface": "{}", "coarse": {{"mesher": "lattice", "surface_triangles": 300}}, "fixed": [{{"box": [[-1, -1, -1], [1, 1, 0.001]]}}],
        "material": {{"young_modulus": 4, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.002, "mass_damping": 5}}}}}},
        "effects": ["elasticity", "gravity", "damping", "coarse_contact", "self_contact"]}})",
                       file.string());
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
    const std::size_t at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

/// The wire follows its route round the bend.
std::string steered_wire(const std::string& budget) {
    std::string text = test::bent_tube_scene({.budget = budget,
                                              .effects = R"("elasticity", "damping", "coarse_contact", "exact_contact", "friction")",
                                              .host_body = test::kOrgan});
    const std::size_t path = text.find("\"path\":"), end = text.find("]]", path) + 2;
    text.replace(path, end - path, R"("follow": {"target": "end", "speed": 30})");
    return replaced(text, "\"effects\":", R"("targets": {"end": {"position": [70, 0, 75]}}, "effects":)");
}

std::vector<SceneCase> scenes() {
    std::vector<SceneCase> list;
    for (const char* budget : {"work:300", "work:20000", "exact"})
        list.push_back(
            {fmt::format("WireInATube under {}", budget), test::bent_tube_scene({.speed = 300.0, .budget = budget}), 40, {1, 13, 30}});
    for (const char* budget : {"work:2000", "work:60000", "exact"})
        list.push_back({fmt::format("WireInAnOrgan under {}", budget),
                        test::bent_tube_scene({.speed = 300.0,
                                               .budget = budget,
                                               .effects = R"("elasticity", "damping", "coarse_contact", "exact_contact", "friction")",
                                               .host_body = test::kOrgan}),
                        40,
                        {1, 13, 30}});
    list.push_back({"TwistingWire",
                    test::bent_tube_scene(
                        {.speed = 300.0, .budget = "work:20000", .effects = R"("coarse_contact", "exact_contact", "friction", "twist")"}),
                    40,
                    {1, 13, 30}});
    list.push_back({"WireInACatheter",
                    replaced(test::bent_tube_scene({.speed = 300.0, .budget = "work:20000"}), "\"instruments\": {",
                             R"("instruments": {"catheter": {"length": 200, "radius": 0.8, "young_modulus": 60000, "segment": 2.5,
                                "skin_triangles": 1500, "lumen": "tube", "entry": {"position": [0, 0, 10], "direction": [0, 0, 1]},
                                "tip": {"shape": "straight"}, "path": [[0, 18, 0], [2, 60, 1]]},)"),
                    40,
                    {1, 13, 30}});
    list.back().text = replaced(list.back().text, R"("lumen": "tube",
        "entry": {"position": [0, 0, 10], "direction": [0, 0, 1]},
        "limits")",
                                R"("inside": "catheter",
        "limits")");
    list.push_back({"SteeredWire", steered_wire("work:8000"), 150, {1, 60, 131}});
    for (const char* budget : {"work:9", "work:400", "exact"})
        list.push_back({fmt::format("Heap under {}", budget), heap(budget, ""), 110, {1, 33, 60, 95}});
    list.push_back({"HeapOfOpenPairs", heap("work:30", R"("solid_response": "spheres", )"), 80, {1, 33, 60}});
    for (const char* trees : {"wrapped", "heuristic"})
        list.push_back(
            {fmt::format("HeapOn {} trees", trees), heap("work:300", fmt::format(R"("sphere_trees": "{}", )", trees)), 80, {1, 33, 60}});
    list.push_back({"SelfContact", clasp(), 120, {1, 30, 61, 100}});
    list.push_back({"CulledByTheCpuReference",
                    replaced(test::bent_tube_scene({.speed = 300.0, .budget = "work:200000"}),
                             "\"effects\":", R"("contact": {"culling": "cpu"}, "effects":)"),
                    30,
                    {1, 13}});
    return list;
}

class Resumed : public ::testing::TestWithParam<SceneCase> {};

TEST_P(Resumed, RunIsTheUninterruptedOneToTheBitInAllThatDecidesTheNextStep) {
    const SceneCase& scene = GetParam();
    const PreparedScene prepared = test::prepare(scene.text);
    ASSERT_FALSE(prepared.model.bodies.empty());
    Simulator whole(prepared.model);
    std::vector<std::uint64_t> memory{memory_hash(whole)};
    std::vector<std::string> files;
    std::uint64_t touched = 0;
    while (whole.state().step < scene.steps) {
        const StepReport& report = whole.step();
        ASSERT_TRUE(report.finite) << report.failure;
        touched += report.contact_force_n > 0.0 || report.solid_touches + report.held_pairs > 0;
        memory.push_back(memory_hash(whole));
        if (std::find(scene.cuts.begin(), scene.cuts.end(), whole.state().step) != scene.cuts.end())
            files.push_back(checkpoint_bytes(make_checkpoint(whole)));
    }
    EXPECT_GT(touched, scene.steps / 8) << "something must be in contact";
    for (const std::string& bytes : files) {
        const auto checkpoint = parse_checkpoint(bytes, "checkpoint.bin");
        ASSERT_TRUE(checkpoint.ok()) << checkpoint.error().to_string();
        SCOPED_TRACE(fmt::format("cut after step {}", checkpoint->step));
        Simulator later(prepared.model);
        const auto resumed = resume(later, *checkpoint, "checkpoint.bin");
        ASSERT_TRUE(resumed.ok()) << resumed.error().to_string();
        EXPECT_EQ(memory_hash(later), memory[checkpoint->step]) << "what was read is what was written";
        while (later.state().step < scene.steps) {
            ASSERT_TRUE(later.step().finite);
            ASSERT_EQ(memory_hash(later), memory[later.state().step]) << "step " << later.state().step;
        }
        EXPECT_EQ(hash_state(later.state()), hash_state(whole.state()));
        EXPECT_EQ(later.report().work_units, whole.report().work_units);
        EXPECT_EQ(later.report().residual_n, whole.report().residual_n);
    }
}
INSTANTIATE_TEST_SUITE_P(Scenes, Resumed, ::testing::ValuesIn(scenes()), [](const auto& tested) {
    std::string name = tested.param.name;
    for (char& c : name)
        if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'))) c = '_';
    return name;
});

struct CheckpointFile : ::testing::Test {
    CheckpointFile() : prepared(test::prepare(heap("work:400", ""))), simulator(prepared.model) {
        for (int k = 0; k < 30; ++k) EXPECT_TRUE(simulator.step().finite);
        bytes = checkpoint_bytes(make_checkpoint(simulator));
    }
    [[nodiscard]] static std::string complaint(const std::string& text) {
        const auto parsed = parse_checkpoint(text, "some.bin");
        return parsed.ok() ? std::string() : parsed.error().to_string();
    }
    PreparedScene prepared;
    Simulator simulator;
    std::string bytes;
};

TEST_F(CheckpointFile, GoesOnWithTheSameInputsToTheSameBits) {
    Inputs inputs;
    inputs.pull = Pull{1, 3, Vec3(0.01, 0.02, 0.03)};
    ASSERT_TRUE(simulator.step(inputs).ok());
    const Checkpoint checkpoint = make_checkpoint(simulator);
    Simulator later(prepared.model);
    ASSERT_TRUE(resume(later, checkpoint, "x").ok());
    for (int k = 0; k < 5; ++k) {
        ASSERT_TRUE(later.step(inputs).ok());
        ASSERT_TRUE(simulator.step(inputs).ok());
    }
    EXPECT_EQ(hash_state(later.state()), hash_state(simulator.state()));
    EXPECT_GT(later.report().pull_force_n, 0.0);
}

TEST_F(CheckpointFile, OfAnotherSceneIsRefusedWithBothNames) {
    const PreparedScene other = test::prepare(heap("work:400", R"("margin": 0.4, )"));
    Simulator wrong(other.model);
    const auto resumed = resume(wrong, *parse_checkpoint(bytes, "some.bin"), "some.bin");
    ASSERT_FALSE(resumed.ok());
    EXPECT_THAT(resumed.error().to_string(), ::testing::HasSubstr("another scene"));
    EXPECT_EQ(resumed.error().code, ErrorCode::BadValue);
}

TEST_F(CheckpointFile, ThatIsNoneOrOfAnotherVersionOrCutOffIsRefused) {
    EXPECT_THAT(complaint("step,time_s\n"), ::testing::HasSubstr("is no checkpoint"));
    EXPECT_THAT(complaint(""), ::testing::HasSubstr("is no checkpoint"));
    std::string newer = bytes;
    newer[std::string("trocar-checkpoint\n").size()] = 77;
    EXPECT_THAT(complaint(newer), ::testing::HasSubstr("version 77"));
    for (std::size_t length = 0; length < bytes.size(); length += length < 200 ? 1 : 9973)
        EXPECT_NE(complaint(bytes.substr(0, length)), "") << length;
    EXPECT_THAT(complaint(bytes + "x"), ::testing::HasSubstr("not as long"));
}

TEST_F(CheckpointFile, WithAnyBitTurnedIsRefused) {
    std::mt19937 random(7);
    for (int k = 0; k < 400; ++k) {
        std::string changed = bytes;
        const std::size_t at = random() % bytes.size();
        changed[at] = static_cast<char>(changed[at] ^ (1 << (random() % 8)));
        EXPECT_NE(complaint(changed), "") << "byte " << at;
    }
}

/// Arbitrary bytes under a valid header and hash: refused, or restored, and then steps do not crash.
TEST_F(CheckpointFile, WithAMemoryOfNonsenseNeverCrashesNorTakesMuchMemory) {
    const unsigned seed = 11;
    std::mt19937 random(seed);
    Checkpoint checkpoint = *parse_checkpoint(bytes, "some.bin");
    const std::string sound = checkpoint.state;
    int refused = 0;
    for (int k = 0; k < 300; ++k) {
        checkpoint.state = sound;
        for (unsigned changes = 1 + random() % 4; changes > 0; --changes) {
            const std::size_t at = random() % sound.size();
            checkpoint.state[at] = static_cast<char>(random());
            if (random() % 8 == 0)
                for (std::size_t b = at; b < std::min(at + 8, sound.size()); ++b) checkpoint.state[b] = '\xff';
        }
        if (random() % 8 == 0) checkpoint.state.resize(random() % sound.size());
        Simulator later(prepared.model);
        const bool taken = resume(later, checkpoint, "some.bin").ok();
        refused += !taken;
        (void)later.step();
        if (taken && later.report().finite) {
            EXPECT_EQ(later.state().step, checkpoint.step + 1);
        }
    }
    EXPECT_GT(refused, 10) << "seed " << seed;
}

TEST(ByteStream, GivesBackWhatItTookAndZeroBehindTheEnd) {
    std::string bytes;
    ByteWriter out(bytes);
    out.number(std::uint16_t{513}), out.number(-0.0), out.number(true), out.text("ab");
    out.vector(Vec3(1.0, -2.0, 3e-300));
    out.list(std::vector<Index>{7, 8}, [&](Index i) { out.number(i); });
    EXPECT_EQ(bytes.substr(0, 2), std::string("\x01\x02", 2)) << "lowest byte first";
    ByteReader in(bytes);
    std::uint16_t small = 0;
    double zero = 1.0;
    bool flag = false;
    std::string text;
    Vec3 v;
    std::vector<Index> list;
    in.number(small), in.number(zero), in.number(flag), in.text(text), in.vector(v);
    in.list(list, [&](Index& i) { in.number(i); });
    EXPECT_EQ(small, 513);
    EXPECT_TRUE(std::signbit(zero));
    EXPECT_TRUE(flag);
    EXPECT_EQ(text, "ab");
    EXPECT_EQ(v, Vec3(1.0, -2.0, 3e-300));
    EXPECT_THAT(list, ::testing::ElementsAre(7, 8));
    EXPECT_TRUE(in.ok() && in.at_end());
    in.number(small);
    EXPECT_FALSE(in.ok());
    EXPECT_EQ(small, 0);
}

TEST(ByteStream, ALengthThatLiesEndsTheListWithItsBytes) {
    std::string bytes;
    ByteWriter out(bytes);
    out.number(~std::uint64_t{0}), out.number(Index{1}), out.number(Index{2});
    ByteReader in(bytes);
    std::vector<Index> list;
    in.list(list, [&](Index& i) { in.number(i); });
    EXPECT_FALSE(in.ok());
    EXPECT_LE(list.capacity(), 8u);
}

} // namespace
} // namespace trocar::engine
