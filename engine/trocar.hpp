// All that a program needs to load a scene, prepare it, step, drive, fork and read it: one include. Names are in trocar::engine.
//
//     #include <trocar.hpp>
//
//     const auto scene = trocar::engine::read_scene("scene.json");
//     const auto prepared = trocar::engine::prepare_scene(*scene);
//     trocar::engine::Simulator simulator(*prepared);
//     simulator.step();
//
// This and what it includes is all that is installed (tests/install counts it). What it declares and does not define, such as SceneModel
// and State, is the engine's own: programs hold it, and see it through views.hpp.
#pragma once

#include "base/topology.hpp"             // what is wrong with a surface
#include "engine/effects/registry.hpp"   // effects, and effects of the program's own
#include "engine/io/read_surface.hpp"    // surfaces from files
#include "engine/io/write_mesh.hpp"      // and into them
#include "engine/prepare/prepared.hpp"   // a scene's model, shared by any number of simulators
#include "engine/scene/scene.hpp"        // a scene, and how it is read
#include "engine/state/inputs.hpp"       // what somebody does during a step
#include "engine/state/step_report.hpp"  // what a step did
#include "engine/state/views.hpp"        // what it left: bodies and instruments
#include "engine/step/checkpoint.hpp"    // a state as a file
#include "engine/step/simulator.hpp"     // steps
