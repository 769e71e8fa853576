#include "targets.hpp"

#include "engine/experiments/sweep/result_store.hpp"
#include "engine/io/mesh_path.hpp"
#include "engine/report/grant_record.hpp"
#include "engine/step/checkpoint.hpp"
#include "tests/engine/io_bytes.hpp"

namespace trocar::fuzz {

using namespace engine;

namespace {

void add_samples(std::string_view target, std::vector<std::string>& seeds) {
    std::vector<test::Sample> samples = test::tet_samples();
    for (test::Sample& sample : test::surface_samples()) samples.push_back(std::move(sample));
    for (const test::Sample& sample : samples) {
        std::string extension = mesh_extension(sample.name).substr(1);
        if (extension == "vtp") extension = "vtu";
        if (extension == "mesh") extension = "medit";
        if (extension == target) seeds.push_back(sample.bytes);
    }
}

const char* kScene = R"({"name": "a", "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 1},
"budget": {"limit": "1ms", "scope": "step", "drop": ["exact_contact"]}, "gravity": [0, 0, -9810],
"bodies": {"organ": {"kind": "deformable", "surface": {"shape": "box", "centre": [0, 0, 0], "extent": [1, 2, 3], "cells": 4},
"material": {"law": "stvk", "young_modulus": 5, "poisson_ratio": 0.4, "density": 1000}, "fixed": [{"direction": [0, 1, 0], "fraction": 0.1}]},
"tube": {"kind": "static", "hollow": true, "embedded_in": "organ", "blend": 5, "surface": {"shape": "tube", "axis": [[0, 0, 0, 4], [0, 0, 9, 4]], "sides": 16}}},
"instruments": {"wire": {"length": 100, "radius": 0.5, "young_modulus": 60, "segment": 5, "tip": {"shape": "J", "length": 12, "angle": 0.6},
"lumen": "tube", "entry": {"position": [0, 0, 1], "direction": [0, 0, 1]}, "path": [[0, 20, 0], [0.2, 26, 0.4]]}},
"targets": {"end": {"position": [0, 0, 8]}}, "contact": {"margin": 0.3},
"effects": ["elasticity", "gravity", {"name": "breathing", "amplitude": 10}], "outputs": {"pictures": 2}}
)";

const char* kSweep = R"({"scene": ["a.json", "b.json"], "command": "run", "options": ["-n", "20"], "repeat": 2, "draws": {"count": 3, "seed": 1},
"vary": {"/budget": ["exact", "work:5"], "/x/y": {"from": 0, "to": 1, "count": 3}, "/z": {"from": 1, "to": 100, "count": 3, "scale": "log"},
"/u": {"uniform": [0, 1]}, "/l": {"log_uniform": [1, 9]}, "/n": {"normal": [0, 1]}, "/i": {"integer": [-3, 4]}, "/c": {"choice": [1, "a", [2]]}, "--fast": [1]},
"collect": {"hash": "/state_hash", "peak": {"column": "max_contact_force_n", "take": "p99"}}, "keep": "folder", "time_limit": 10}
)";

std::string sound_plan() {
    SweepPlan plan;
    plan.program = "trocar", plan.folder = "/sweeps";
    plan.options = {"-n", "20"}, plan.scene_names = {"a.json"};
    plan.scenes = {{"/sweeps/a.json", "00"}}, plan.files = {{"/sweeps/a.obj", "11"}};
    plan.axes = {{{"/budget", "--fast"}, {{"\"exact\"", "1"}, {"\"work:5\"", "[2,\"a\"]"}}}};
    plan.repeat = 3, plan.chunk_runs = 2;
    plan.collect = {{"hash", "/state_hash", "", "", {}}, {"peak", "", "max_contact_force_n", "p99", {}}};
    return plan.text();
}

std::string sound_frames() {
    std::string bytes = "name a\nnV 3\nnT 1\nframes 2\n|";
    for (const std::int32_t v : {0, 1, 2}) test::put(bytes, v);
    bytes += '|';
    for (int k = 0; k < 3; ++k) test::put(bytes, std::int32_t{0});
    bytes += '|';
    for (int k = 0; k < 18; ++k) test::put(bytes, 0.5 * k);
    return bytes;
}

std::string sound_record() {
    GrantRecord record{0x1234, "a scene", {BudgetMode::Wall, 1e-3, 0}, true, 0x99, {}};
    record.steps.push_back({7, {{DecisionKind::Descent, 4096}, {DecisionKind::Fits, 1}}});
    record.steps.push_back({8, {}});
    return grant_record_text(record);
}

/// What was found once: by libFuzzer, or by reading with it in mind.
void add_found(std::string_view target, std::vector<std::string>& seeds) {
    if (target == "ply") // vertices without properties take no bytes: the face named vertices that were not stored
        seeds.emplace_back(
            "ply\nformat ascii 1.0\nelement vertex 3\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n3 0 1 2\n");
    if (target == "ply") // counts whose sum is a small number again
        seeds.emplace_back(
            "ply\nformat ascii 1.0\nelement vertex 9223372036854775807\nelement vertex 9223372036854775807\nelement vertex 5\n"
            "property float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n");
    if (target == "tetgen") // the number after the largest one is no number
        seeds.emplace_back(
            "4 3 0 0\n9223372036854775807 0 0 0\n-9223372036854775808 1 0 0\n-9223372036854775807 0 1 0\n-9223372036854775806 0 0 1\n\x01"
            "1 4 0\n1 9223372036854775807 -9223372036854775808 -9223372036854775807 -9223372036854775806\n");
}

} // namespace

std::vector<std::string> seeds_of(std::string_view target) {
    std::vector<std::string> seeds;
    add_samples(target, seeds);
    add_found(target, seeds);
    if (target == "scene") seeds.emplace_back(kScene);
    if (target == "recipe") seeds.emplace_back(R"({"units": {"length": "mm", "angle": "deg"}, "seed": 7})");
    if (target == "path") seeds.insert(seeds.end(), {"t,insertion,rotation\n0,20,0\n0.5,30,1\n", "# no head\n0 , 1 , 2\n\n1,2,3"});
    if (target == "ccd")
        seeds.emplace_back(
            "0,1,0,1,2,1,1\n0,1,0,1,0,1,1\n4,1,0,1,0,1,1\n0,1,4,1,0,1,1\n0,1,0,1,-2,1,1\n0,1,0,1,0,1,1\n4,1,0,1,0,1,1\n0,1,4,1,0,1,1\n");
    if (target == "tetgen")
        seeds.emplace_back("4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n\x01"
                           "1 4 0\n1 1 2 3 4\n");
    if (target == "sph") seeds.insert(seeds.end(), {"1 8\n0 0 0 1 1\n", "2 2\n0 0 0 1 1\n0 0 0 0.5 1\n1 0 0 0.5 1\n"});
    if (target == "frames") seeds.push_back(sound_frames());
    if (target == "replay") {
        std::string capitals = sound_record(); // of the hash at its end: read as well
        for (std::size_t k = capitals.rfind("end ") + 4; k < capitals.size(); ++k)
            if (capitals[k] >= 'a' && capitals[k] <= 'f') capitals[k] = static_cast<char>(capitals[k] - 'a' + 'A');
        seeds.insert(seeds.end(), {sound_record(), capitals});
    }
    if (target == "checkpoint")
        seeds.push_back(checkpoint_bytes({0x77, "a scene", {BudgetMode::Work, 0.0, 300}, 12, std::string(64, '\x05')}));
    if (target == "gzip")
        seeds.insert(seeds.end(), {test::deflate_bytes("some text, some text, some text"), test::deflate_bytes("zlib", 15)});
    if (target == "sweep") seeds.emplace_back(kSweep);
    if (target == "plan") seeds.push_back(sound_plan());
    if (target == "result") {
        seeds.push_back(result_line({5, "00ff", "failed: exit 3: \"a\",", {"1.5", "", "\xc3\xa4"}, R"({"a":[1,null,1e300]})"}));
        seeds.back().pop_back();
    }
    if (target == "rows") seeds.insert(seeds.end(), {"/budget,/x\nexact,\"a \"\"b\"\", c\"\n\n,\n1,2", "\xEF\xBB\xBF" "a\r\n1\r\n", "\xEF\xBB\xBF\xEF\xBB\xBF\n1"});
    if (target == "message")
        for (const char* message :
             {R"({"type": "drive", "insertion": 0.5, "rotation": -1})", R"({"type": "budget", "mode": "wall", "ms": 8})",
              R"({"type": "budget", "mode": "work", "units": 300})", R"({"type": "effect", "name": "gravity", "on": true})",
              R"({"type": "grab", "body": 0, "vertex": 99, "target": [0.1, -0.2, 1e-3]})", R"({"type": "pace", "factor": 0.5})",
              R"({"type": "ping", "number": 7})", R"({"type": "let_go"})"})
            seeds.emplace_back(message);
    if (target == "meeting")
        for (unsigned head = 0; head < 16; ++head) {
            std::string bytes(1, static_cast<char>(head));
            for (int k = 0; k < 200; ++k) bytes += static_cast<char>(37 * k * k + 11 * k + static_cast<int>(head));
            seeds.push_back(bytes);
        }
    return seeds;
}

} // namespace trocar::fuzz
