#!/usr/bin/env python3
"""Breaks the product on purpose, one place at a time, and shows that some test fails.

    tests/mutation/mutants.py [--work FOLDER] [--jobs N] [--only NAME ...] [--markdown FILE]
    tests/mutation/mutants.py --build build/release [...]       of a finished build: a file is compiled and a program linked per mutant
    tests/mutation/mutants.py --places                          only: is each mutant's place still there, once?
    tests/mutation/mutants.py --members --build build/release   only: leaves every member of the state out of its visitor, one at a time

Every mutant is one small edit: a sign, a tolerance, a missed child, a wrong winding, a stale box. The edits are made in a copy of the
tracked files (FOLDER, /tmp/trocar-mutants by default, kept between runs so that ccache and ninja have little to do); for each the
named test program is built and run with the named filter. A mutant is killed when that run fails, and survives when it passes: then a
test is missing, and the exit code is 1. Before the first mutant every filter must pass on the unchanged sources.

With --build nothing is copied or built but the mutated file, without optimisation: its object goes before the libraries of that build,
whose sources must be those of this folder. Minutes instead of half an hour. Of a header the sources that include it are compiled, by name
and in its own module: one that others include in turn would be broken in part only.
"""

import argparse
import json
import os
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
LIMIT_S = 120  # a mutant may loop for ever: then it is killed too


class Mutant(NamedTuple):
    name: str
    what: str  # what is broken
    file: str
    old: str
    new: str
    module: str  # test_<module>
    filter: str


MUTANTS = [
    Mutant("closest-sign", "the sign of one corner's share of the closest point of a triangle", "base/closest_point.cpp",
           "a + best.bary[1] * ab - best.bary[2] * ca", "a + best.bary[1] * ab + best.bary[2] * ca", "base", "ClosestPoint.*"),
    Mutant("segment-end", "a segment's far end is forgotten", "base/closest_point.cpp",
           "std::min(along / length_sq, 1.0)", "along / length_sq", "base", "ClosestPoint.*:ClosestSegments.*"),
    Mutant("edge-beside", "an edge that the point is beyond is left out for another one", "base/closest_point.cpp",
           "if (!clearly_inside(weight_a)) keep_nearer", "if (!clearly_inside(weight_b)) keep_nearer", "base", "ClosestPoint.*"),
    Mutant("tree-ties", "of equally near triangles the one that is found first counts", "base/triangle_tree.cpp",
           "(hit.distance_sq == best_sq && order_[slot] < best.triangle)", "(hit.distance_sq == best_sq && best.triangle == kNoIndex)", "base", "TriangleTree.*"),
    Mutant("tree-stale-box", "stale boxes: only leaves are refitted", "base/triangle_tree.hpp",
           "box.add(nodes[node.first].box);", "", "base", "TriangleTree.*:InsideTest.*"),
    Mutant("tree-stale-corners", "stale corners: a refit moves two of three corners", "base/triangle_tree.cpp",
           "for (std::size_t k = 0; k < 3; ++k) {\n            assert(triangles_[slot][k]",
           "for (std::size_t k = 0; k < 2; ++k) {\n            assert(triangles_[slot][k]", "base", "TriangleTree.*:InsideTest.*"),
    Mutant("tree-parts-stay", "a part's boxes do not go where its vertices have gone", "base/triangle_tree_follow.cpp",
           "ways = {least, most};", "ways = {Vec3::Zero(), Vec3::Zero()};", "base", "TriangleTree.*"),
    Mutant("tree-parts-open", "a part that is open is thought to be renewed", "base/triangle_tree_follow.cpp",
           "    fit_boxes(nodes_, part.node_begin, part.node_end, [&](Index slot) { return corners_at(slot); });", "", "base", "TriangleTree.*"),
    Mutant("small-grants-teach-nothing", "a rate that allows small grants alone stays for good", "engine/time/step_budget.cpp",
           "if (descent_lesson_ < kSmallestLesson) return;", "if (grant.spent() < kSmallestLesson) return;", "engine", "StepBudget.*"),
    Mutant("inside-sign", "what is inside counts as outside", "base/inside.cpp",
           "return inside(p) ? -nearest->distance : nearest->distance;", "return inside(p) ? nearest->distance : -nearest->distance;", "base",
           "InsideTest.*"),
    Mutant("tree-stands-still", "bounds that are not made anew do not allow for the way since", "collision/bvh/dop_tree.cpp",
           "out[s * arity] = way > 0.0 ?", "out[s * arity] = way < 0.0 ?", "collision", "DopTree.*"),
    Mutant("tree-old-cluster", "a cluster that the last search brought along is not brought to the next motion", "collision/bvh/dop_tree.hpp",
           "if (cluster_at_[cluster] != travelled_) bring_cluster(cluster);", "if (cluster_at_[cluster] == 0.0) bring_cluster(cluster);", "collision", "DopTree.*"),
    Mutant("lumen-goes-on", "a lumen that was left out for some steps goes on as if it had not been", "engine/step/instrument/instrument_stage.cpp",
           "const bool continues = own.lumen_step + 1 == state.step;", "const bool continues = true;", "engine", "LazyEvaluation.*"),
    Mutant("impulse-one-sided", "an impulse between solids pushes one of them harder", "engine/step/contact/contact_solver.cpp",
           "add(1, row.b, foot, k, -row.b.blend", "add(1, row.b, foot, k, -0.999 * row.b.blend", "engine", "SolidLaws.AFreeSystem*"),
    Mutant("impulse-two-places", "the second body feels the impulse at its own place", "engine/step/contact/contact_solver.cpp",
           "(void)fem::find_affine(x, row.b.image(foot, of_b) + aside, weight);", "(void)x, (void)aside;", "engine", "SolidLaws.AFreeSystem*"),
    Mutant("together", "two sides that the same nodes move are parted by an impulse over rounding", "engine/step/contact/contact_solver.cpp",
           "if (row.mobility < kTogether * apart) row.mobility = 0.0;", "(void)apart;", "engine", "ContactSolver.*"),
    Mutant("far-passed", "a place that was left out as far is left out whatever the impulses of the others", "engine/step/contact/contact_solver.cpp",
           "if (flags_[k].near || !bounds_.may_close(k, h)) continue;", "if (flags_[k].near || h > 0.0) continue;", "engine", "ContactSolver.WhatItLeavesOut*"),
    Mutant("gives-more", "a solve that did not end may give what contact never took", "engine/step/contact/contact_solver.cpp",
           "limit_energy(std::max(0.0, spare));", "limit_energy(1e9 + spare);", "engine", "ContactSolver.ASolveThatEndsEarly*"),
    Mutant("edges-not-sought", "edges that cross are seen once one lies in the other body", "engine/step/solid/solid_touch.cpp",
           "for (LeafPair& pair : solids.batch) touch_edges(from_a, first_touch, pair);", "", "engine", "EdgeContact.Bl*"),
    Mutant("edges-forgotten", "edges that press are forgotten from step to step", "engine/step/solid/solid_touch.cpp",
           "if (first && have_edges) touch_edges_before(from_a, first_touch);", "", "engine", "EdgeContact.*"),
    Mutant("corner-mean", "a sharp corner looks along its mean normal alone", "engine/step/solid/vertex_touch.cpp",
           "const bool looks_at = -touch.normal.dot(own.axis) >= own.cosine;", "const bool looks_at = false;", "engine", "EdgeContact.ASharp*"),
    Mutant("coming-not-sought", "a tip is met by what is nearest to it alone", "engine/step/solid/vertex_touch.cpp",
           "return meets && coming.normal.dot(nearest.normal) > kSamePlane ? nearest : coming;", "return meets ? std::optional(nearest) : std::nullopt;", "engine", "TipContact.*"),
    Mutant("plane-reaches", "the plane at an edge holds what flies past it", "engine/step/solid/vertex_touch.cpp",
           "if (meets && nearest.gap + nearest.normal.dot(path) >= 0.0) return nearest;", "if (meets) return nearest;", "engine", "TipContact.*"),
    Mutant("edges-reach", "two edges that pass beside one another are held", "engine/step/solid/edge_touch.cpp",
           "return sweep(next, next_there).hit();", "return true;", "engine", "TipContact.*"),
    Mutant("coming-anywhere", "what slides over a rim goes in by the face that it would meet if it fell", "engine/step/solid/vertex_touch.cpp",
           "< kFacing && at_end.dot(normal) > kFarSide) in = *end", "< -2.0) in = *end", "engine", "TipContact.*"),
    Mutant("corner-by-link", "sharp corners that stand off a lattice follow their links", "engine/prepare/prepare_body.cpp",
           "if (model.links) fem::follow_tets(", "if (false) fem::follow_tets(", "engine", "SharpCorners.*"),
    Mutant("edge-beside-held", "what is near an edge is kept off that, whatever its path", "engine/step/solid/vertex_touch.cpp",
           "< kOnFace * at.distance - kNoWay);", "< -2.0 * at.distance);", "engine", "TipContact.*"),
    Mutant("corner-cut", "what cuts the corner of a body comes back to the side by which it went in", "engine/step/solid/solid_passage.cpp",
           "if (!inside && alike > kFarSide && !looks_at", "if (!inside && alike > 2.0 && !looks_at", "engine", "TipContact.*"),
    Mutant("edges-end", "where one edge of a rim ends, what lay on it falls through the next", "engine/step/solid/edge_touch.cpp",
           " && !goes_on_there(way, e, f, *found, reach)) continue;", ") continue;", "engine", "TipContact.*"),
    Mutant("creases-sharp", "a crease is a sharp edge", "engine/prepare/sharp_edges.cpp",
           "if (apex != u.end() && normal.dot(at[*apex] - at[v0]) < 0.0)", "if (apex != u.end())", "engine", "SharpEdges.*"),
    Mutant("drive-not-written", "a drive command is no number that a path can write", "engine/step/instrument/instrument_stage.cpp",
           "return std::nearbyint(value * 0x1p40) * 0x1p-40;", "return value;", "engine", "PathReplay.*"),
    Mutant("plane-rigid", "a rod meets tissue as if it gave way by nothing", "engine/step/instrument/wall_facets.hpp",
           "return along * along * give > rod_;", "return along * along * give > 1e9 * rod_;", "engine", "RodInTissue.*"),
    Mutant("felt-forgotten", "a rod's solve knows nothing of what the tissue felt", "engine/step/instrument/wall_facets.cpp",
           "now.planes[k].felt = *felt,", "now.planes[k].felt = 0.0 * *felt,", "engine", "RodInTissue.*"),
    Mutant("carried-for-ever", "where there is no time the same places get new planes in every step, the others never", "engine/step/instrument/carry_response.cpp",
           "(slot + state.step) % kStagger == 0", "slot % kStagger == 0", "engine", "CarriedResponse.*"),
    Mutant("hard-for-ever", "easy steps after hard ones are not answered in whole", "engine/time/step_budget.cpp",
           "return look_ahead_s() > 0.0 ? ratio", "return look_ahead_s() > 1e9 ? ratio", "engine", "StepBudget.AResponse*"),
    Mutant("curve-overturned", "a part of an arc turns by all of the arc's angle", "fem/rod/tip_arcs.cpp",
           "arc.angle * (inside / arc.length)", "arc.angle * (inside > 0.0)", "fem", "TipArcs.TurnBy*"),
    Mutant("layers-forgotten", "an instrument of layers is as stiff as its outermost one", "engine/scene/section.cpp",
           "std::vector<TubeLayer> layers = instrument.layers;", "std::vector<TubeLayer> layers(instrument.layers.rbegin(), instrument.layers.rbegin() + !instrument.layers.empty());", "engine", "Tubes.OfDifferent*"),
    Mutant("answer-halved", "the tissue feels half of what the rod's answer says", "engine/step/instrument/wall_exchange.cpp",
           "Vec3(pushed + push.felt - push.force)", "Vec3(pushed + push.felt - 0.5 * push.force)", "engine", "RodInTissue.*"),
    Mutant("given-unsearched", "how a place of the wall gives is found without a line search", "fem/rod/rod_contact.hpp",
           "kGivenTolerance{.overshoot = 1e-9,", "kGivenTolerance{.overshoot = 1e300,", "engine", "RodInTissue.AStiff*"),
    Mutant("one-sided-planes", "planes are taken from the nearest side alone", "engine/step/instrument/wall_facets.cpp",
           "kSpreads[] = {{0.5, 1}, {0.9, 3},", "kSpreads[] = {{0.9, 3}, {0.9, 3},", "engine", "WallPlanes.ARodThatFits*"),
    Mutant("asleep-for-good", "a plane that nothing has met is not evaluated where the rod comes to it", "fem/rod/rod_contact.hpp",
           "if (near_.asleep[k] != 0 && !(near_.offset[k] - near_.normal[k].dot(at) > 0.0)) continue;", "if (near_.asleep[k] != 0) continue;",
           "fem", "RodContact.*"),
    Mutant("friction-without-give", "a wall that gives way does not give way to friction", "fem/rod/rod_contact.hpp",
           "kStickReach + plane.give * bound", "kStickReach + 0.0 * plane.give * bound", "engine", "AroundSolids.APressComes*"),
    Mutant("facets-left-out", "of tissue that folds around a rod no more facets get planes than of a rigid wall", "engine/step/instrument/wall_facets.cpp",
           "{0.995, kPlanesPerPlace, 2.0, true}", "{0.995, kPlanesPerPlace, 0.0, true}", "engine", "RodInTissue.ACoarse*"),
    Mutant("solids-left-out-of-links", "the wall of the free space rests where the solid moves", "engine/prepare/free_space.cpp",
           "place(own.vertex_blend, links.vertex_blend);", "", "engine", "AroundSolids.TheWall*"),
    Mutant("unheld", "what pressed lets go in a stage's first correction", "fem/rod/rod_step.hpp",
           "contact_.evaluate_held(), self_", "contact_.evaluate(), self_", "scenarios", "Scenario.AWireFinds*"),
    Mutant("uncoupled", "what couples places of a rod is left out of the direction", "fem/rod/rod_step.hpp",
           "        if (!work_.couplings.empty())\n", "        if (work_.couplings.size() > 100000)\n", "fem", "RodSelf.*"),
    Mutant("late-contacts", "a run begins without contacts", "engine/step/simulator.cpp",
           "if (fresh && !stopped) find_first", "if (fresh && stopped) find_first", "engine", "SolidLaws.WhatBegins*"),
    Mutant("unproven-rod", "a rod's motion past itself is not proven", "fem/rod/self_contact.cpp",
           "    if (share >= 1.0) return share;\n", "    return 1.0;\n", "fem", "RodSelf.*"),
    Mutant("short-reach", "pairs of a rod's segments are looked for no farther than they may come", "fem/rod/chain_pairs.cpp",
           "    if (pair.distance < within_ + std::max", "    if (pair.distance < 0.5 * within_ + 0.5 * std::max", "fem", "ChainBoxes.*"),
    Mutant("uncoupled-rods", "what couples two rods is left out of the direction", "fem/rod/rods_together.cpp",
           "            if (!own.press.pushed || is_in_bore(k)) continue;", "            if (k < 100000) continue;", "fem", "RodsTogether.*"),
    Mutant("straight-bore", "a bore is straight between the nodes of its rod", "fem/rod/bore_contact.cpp",
           "    const double length = std::sqrt(point.along.squaredNorm());", "    point.beside.setZero();\n    const double length = std::sqrt(point.along.squaredNorm());",
           "fem", "BoreContact.Nearest*"),
    Mutant("one-wall", "of instruments that are solved together only the first one's wall is followed", "engine/step/instrument/exact_stage.cpp",
           "rods, index)) follow_wall(model, model.instruments[one].lumen, state, rods, budget);",
           "rods, index)) if (one == index) follow_wall(model, model.instruments[one].lumen, state, rods, budget);", "engine", "BoreScene.PairsInTwo*"),
    Mutant("axis-friction", "friction in a bore acts on the axes", "fem/rod/rods_together.cpp",
           "        own.loads = in_bore ? 2 : 1;", "        own.loads = 1;", "fem", "BoreContact.AHandle*"),
    Mutant("pushed-apart", "what couples rods in a bore has the wrong sign in their matrix", "fem/rod/rods_together.cpp",
           "entry(row + u, column + v, -motion_of", "entry(row + u, column + v, motion_of", "fem", "BoreContact.BothBend*"),
    Mutant("unproven-pair", "two rods' motion past one another is not proven", "fem/rod/rod_meetings.cpp",
           "    if (share >= 1.0 || meetings == nullptr) return share;\n", "    return 1.0;\n", "fem", "RodsTogether.*"),
    Mutant("lever-left-out", "friction acts on the axis of a rod, not where rods touch", "fem/rod/rod_part.hpp",
           "edge * lever.transpose()) / length_sq;", "edge * lever.transpose()) * 0.0;", "fem", "RodsTogether.BothFeel*"),
    Mutant("unsearched", "a rod's corrections are not searched along", "fem/rod/rod_step.hpp",
           "        search_along(most, power_, [&]", "        if (most < 0.0) search_along(most, power_, [&]", "engine", "RodIteration.*"),
    Mutant("unheld-wholes", "what the budget leaves between two solids holds nothing", "engine/step/contact/contact_solver.cpp",
           "    if (wholes_ == 0) return;\n", "    return;\n", "engine", "SolidContact.UnderAnyBudget*"),
    Mutant("free-surfaces", "what the response looks at between solids is on nobody's account", "engine/step/solid/surface_account.hpp",
           "if (units == 0 || (open_", "if (units > 0 || (open_", "engine", "Account.*"),
    Mutant("cone-open", "friction is not bounded by what presses", "engine/step/contact/contact_solver.cpp",
           "if (length > most) along *= most / length;", "(void)length, (void)most;", "engine", "SolidLaws.OnASlope*"),
    Mutant("tessellated-normal", "a table's vertex pushes along the facets of what lies on it", "engine/step/solid/normal_cone.cpp",
           "if (facing >= own.cosine - kRounding) return out;", "if (facing >= -1.0) return out;", "engine", "SolidLaws.AFrictionless*"),
    Mutant("lockstep-half-kick", "the last half kick of an island is left out", "engine/step/tissue/integrate_bodies.cpp",
           "kick = 0.5 * (taken + h);", "kick = arrived ? 0.0 : 0.5 * (taken + h);", "engine", "SolidLaws.*"),
    Mutant("island-springs-to-life", "an island in which nothing pressed keeps its own integration", "engine/step/tissue/integrate_bodies.cpp",
           "if (pushed || !std::all_of", "if (true || !std::all_of", "engine", "ContactLaws.*"),
    Mutant("tie-without-reaction", "a tie pulls the wall, and not the organ", "fem/tissue/ties.cpp",
           "Vec3(-tie.weight[k] * pull)", "Vec3(-0.0 * tie.weight[k] * pull)", "engine", "JoinedWall.*"),
    Mutant("ties-unbound", "ties do not shorten the stable step", "fem/tissue/ties.cpp",
           "bound[plan.record_of[tie.node]] += 2.0", "bound[plan.record_of[tie.node]] += 0.0", "engine", "JoinedWall.*"),
    Mutant("wall-unbent", "prisms do not resist bending", "fem/tissue/material.cpp",
           "law.bend = 4.0 / 3.0", "law.bend = 0.0", "fem", "WallMesh.*"),
    Mutant("wall-locks", "prisms feel all of the shear that wide triangles have where they bend", "fem/tissue/prisms.cpp",
           "kShearReach = 0.1;", "kShearReach = 0.0;", "fem", "WallMesh.OfPrismsBends*"),
    Mutant("freed-stays-held", "the frames of a rod that has left its port still begin at the port", "fem/rod/rod_stages.hpp",
           "if (first_ == 0 && twists() && state_->root.isZero(0.0)) free_frames", "if (false) free_frames", "fem", "RodFree.*"),
    Mutant("freed-root-stays", "where a free rod's frames begin does not go along with its first segment", "fem/rod/rod_stages.hpp",
           "if (first_ == 0) carry_root();", "", "fem", "RodFree.*"),
    Mutant("next-coil-pushes-in", "what enters where another instrument is still in the port does not wait", "engine/step/instrument/instrument_stage.cpp",
           "if (!std::all_of(instrument.waits_for.begin(), instrument.waits_for.end(), is_out)) return {0.0, wanted.rotation};", "", "engine", "DetachedCoil.*"),
    Mutant("patches-unround", "a patch grows by whatever adds fewest nodes, however far off", "fem/tissue/patches.cpp",
           "Merit merit{0, places_.distance(tet, sum_ / static_cast<double>(count_)),", "Merit merit{0, 0.0,", "fem", "Patches.*"),
    Mutant("force-rate-forgotten", "a force stays what it is at a step's start", "fem/tissue/substep.cpp",
           "if (!s.inputs.force_rate.empty()) force += (s.time + since) * s.inputs.force_rate[node];", "", "engine", "Loads.*"),
    Mutant("tip-rate-forgotten", "a load on a tip stays what it is at a step's start", "engine/effects/loads/loads.cpp",
           ", acting.tip.force_rate += rate * instrument.tip_force", "", "engine", "Loads.AForce*"),
    Mutant("forced-for-all", "an exact stage that is forced for one instrument leaves the others as they were looked ahead",
           "engine/step/resolve_contacts.cpp", "        if (is_solved_with_another(model, rods, i)) continue;\n        if (!is_tested) {",
           "        if (report.exact_forced || is_solved_with_another(model, rods, i)) continue;\n        if (!is_tested) {", "engine", "Deadline.AnInst*"),
    Mutant("contact-work-shared", "what contact has taken from any body pushes out all of them", "engine/step/tissue/integrate_bodies.cpp",
           "        work += s.bodies.start[i].contact_work;\n", "        for (const BodyStart& any : s.bodies.start) work += any.contact_work;\n", "engine",
           "SolidLaws.WhatTouches*"),
    Mutant("list-ends-early", "the search for planes leaves out what the wall's motion brings near", "engine/step/instrument/wall_planes.cpp",
           "return list.full_within() + wall_way;", "return list.full_within() - wall_way;", "engine", "PlaneReach.OfAFine*"),
    Mutant("met-carried", "a motion in which the exact stage left contacts is carried on", "engine/step/instrument/carry_response.cpp",
           "if (rods.instruments[one].is_met) return false;", "(void)one;", "engine", "Deadline.AnExact*"),
    Mutant("failure-remembered", "what effects remember goes on in a step that fails", "engine/step/stages.cpp",
           "    state.effects = bodies.effects_t0;\n", "", "engine", "Stop.AStep*"),
    Mutant("hold-of-one-node", "the handle of a mass-spring chain feels its last node alone", "fem/rod/mass_spring.cpp",
           "first_ > 2 ? first_ - 2 : 0; i < first_; ++i) hold_", "first_ > 1 ? first_ - 1 : 0; i < first_; ++i) hold_", "fem", "MassSpring.TheHand*"),
    Mutant("tension-shared", "the wire's tension is the catheter's as well", "fem/rod/coaxial.cpp",
           "outer_inside.tension[i] -= at_mouth;", "outer_inside.tension[i] -= 0.0 * at_mouth;", "fem", "Coaxial.*"),
    Mutant("substeps-unwatched", "a number of sub-steps is taken as longest where it asks for fewer", "engine/step/tissue/integrate_bodies.cpp",
           "if (model.fixed_substeps > 0) limits.longest = longest_substep(model);", "", "engine", "Loads.*"),
    Mutant("list-unmapped", "a list names nodes as they are after unused ones were dropped", "engine/prepare/node_sets.cpp",
           "        node = places[node];\n", "", "engine", "NodeSets.*"),
    Mutant("kinks-held", "the kink of a pair of prisms is held like its stretch", "fem/tissue/prisms.cpp",
           "both * std::min(kKinkShare * narrow, kHoldShare) / kPatchShare", "both", "fem", "WallMesh.OfPrismsBends*"),
    Mutant("fibres-straight", "fibres wind round where a vessel begins, whatever its bends", "engine/prepare/fibre_field.cpp",
           "local.fibre_axis = nearest.tangent;", "local.fibre_axis = tree->points[1] - tree->points[0];", "engine", "FibreField.Winds*"),
    Mutant("bending-stays", "branches of relaxation do not see how prisms bend", "fem/tissue/relaxation_kernels.cpp",
           "part[0] = inner(frame.first, bent[p][0]);", "part[0] = hn::Zero(D8());", "fem", "WallMesh.OfPrismsRelaxes*"),
    Mutant("surface-waits", "a surface that no part of a step reads is never evaluated", "engine/step/tissue/tissue_stage.cpp",
           "if (!state.bodies[i].surface_deferred) return;", "return;", "engine", "LazyEvaluation.*"),
    Mutant("wall-stayed-away", "a wall that moves towards a rod is not tested", "engine/step/instrument/wall_planes.cpp",
           "return before - wall_way - ", "return before - ", "engine", "PlaneReach.*"),
    Mutant("iterations-unseen", "only where a solve ends is compared with the reach of its planes, not where its iterations were",
           "engine/step/instrument/wall_planes.cpp", "return std::max(farthest, longest_approach(", "return std::max(0.0, longest_approach(",
           "engine", "PlaneReach.*"),
    Mutant("spring-sign", "a contact spring pulls where it should push", "fem/tissue/springs.cpp",
           "m.push * springs.entries[k].g", "-m.push * springs.entries[k].g", "fem", "Springs.*"),
    Mutant("spring-sticks", "damping acts on leaving too: a spring sticks", "fem/tissue/springs.cpp",
           "m.rate < 0.0 ? -spring.damping * m.rate : 0.0", "-spring.damping * m.rate", "fem", "Springs.*"),
    Mutant("spring-stays-behind", "a spring forgets that what it stands against moves", "fem/tissue/springs.cpp",
           "spring.offset + spring.rate * time", "spring.offset", "fem", "Springs.*"),
    Mutant("step-without-springs", "the stable step forgets the contact springs", "fem/tissue/stable_step.cpp",
           "std::sqrt(elastic + contact.stiffness)", "std::sqrt(elastic)", "fem", "StableStep.*:Advance.*"),
    Mutant("step-too-long", "a sub-step too few", "fem/tissue/stable_step.cpp",
           "const double count = std::ceil(step / stable.step);", "const double count = std::floor(step / stable.step);", "fem",
           "StableStep.*:Advance.*"),
    Mutant("rk4-weights", "the third stage of Runge-Kutta goes half as far", "fem/tissue/integrate.cpp",
           "{NodeUpdate::MiddleStage, 0.5 * h, h},", "{NodeUpdate::MiddleStage, 0.5 * h, 0.5 * h},", "fem", "Integrate.*"),
    Mutant("leapfrog-drift", "leapfrog evaluates its forces at the start", "fem/tissue/integrate.cpp",
           "to.x[axis] += 0.5 * h * from.v[axis];", "to.x[axis] += 0.0 * h * from.v[axis];", "fem", "Leapfrog.*:Integrate.*"),
    Mutant("link-lever-sign", "the moment of a link force has the wrong sign", "fem/embedding/links.cpp",
           "jacobian.block[i] -= blend * lever * rates.node[i]", "jacobian.block[i] += blend * lever * rates.node[i]", "fem", "Links.*:EmbeddedLinks.*"),
    Mutant("foreign-leaf-short", "a leaf from a file does not grow to hold what it was given", "spheretree/build/adopt_tree.cpp",
           "std::max(foreign_.spheres[s].radius, needed_[s] * kRoundOut)", "foreign_.spheres[s].radius", "spheretree", "AdoptedTree.*"),
    Mutant("foreign-ancestors", "spheres above a leaf from a file do not grow with it", "spheretree/build/adopt_tree.cpp",
           "for (Index s = found.leaf; s != kNoIndex; s = foreign_.parent[s])", "for (Index s = found.leaf; s == found.leaf; s = foreign_.parent[s])",
           "spheretree", "AdoptedTree.*"),
    Mutant("foreign-silent", "what a tree from a file lacks is not counted", "spheretree/build/adopt_tree.cpp",
           "coverage_.triangles += !whole;", "", "spheretree", "AdoptedTree.*"),
    Mutant("foreign-seen-from-elsewhere", "a carried tree is compared with one that is seen from a common motion", "engine/step/solid/solid_trees.cpp",
           "if (can_touch_any(model, i) && !is_covering(model.bodies[i])) return {};", "", "engine", "ForeignSpheres.BesideABody*"),
    Mutant("missed-child", "the descent forgets the last child", "spheretree/traverse/descent.cpp",
           "second.tree->child_count[group.second], false, !group.swapped, depth});",
           "static_cast<std::uint16_t>(second.tree->child_count[group.second] - 1), false, !group.swapped, depth});", "spheretree",
           "Descent.*"),
    Mutant("descent-margin", "the descent forgets the margin", "spheretree/traverse/descent.cpp",
           "const double reach = other.radius + margin_;", "const double reach = other.radius;", "spheretree", "Descent.*"),
    Mutant("open-pairs-silent", "a pair that is refined is no longer counted as open", "spheretree/traverse/descent.cpp",
           "    stats_.pairs_open += entry.count;\n", "", "spheretree", "Descent.*"),
    Mutant("self-pairs-twice", "a child is compared with itself and with one before it", "spheretree/traverse/descent.cpp",
           "lay_apart(*first.tree, s, group.second)) return;", "lay_apart(*first.tree, s, s)) return;", "spheretree", "SelfPairs.*"),
    Mutant("spheres-at-start", "stale box: spheres bound the surface at the step's start only", "spheretree/update/covering_tree.cpp",
           "enclose_moving(ids, vertices_t0, vertices_t1)", "enclose_moving(ids, vertices_t0, vertices_t0)", "spheretree",
           "CoveringTree.*"),
    Mutant("chain-does-not-sweep", "an instrument's links are tested at the step's end only", "spheretree/update/chain_tree.cpp",
           "enclose_two(links_t0[link], links_t1[link])", "enclose_two(links_t1[link], links_t1[link])", "spheretree",
           "ChainTree.*:HollowDescent.*"),
    Mutant("touching-boxes", "boxes that only touch no longer overlap", "spheretree/traverse/sweep_and_prune.cpp",
           "boxes[order_[next]].lo[axis_] <= box.hi[axis_]", "boxes[order_[next]].lo[axis_] < box.hi[axis_]", "spheretree",
           "SweepAndPrune.*"),
    Mutant("lumen-one-end", "a ball of the lumen is measured at one end of the step", "spheretree/lumen/lumen_state.cpp",
           "b.radius = std::min(b.radius_t0, b.radius_t1);", "b.radius = b.radius_t0;", "spheretree", "LumenState.*:HollowDescent.*"),
    Mutant("lumen-radius-too-large", "a tolerance: 4 % more free space than there is", "spheretree/lumen/lumen_state.cpp",
           "return std::sqrt(std::max(found_sq, 0.0)) * (1.0 - 1e-12);", "return std::sqrt(std::max(found_sq, 0.0)) * 1.04;", "spheretree",
           "LumenState.*"),
    Mutant("cluster-missed-child", "the traversal forgets a tree's first child", "collision/search/cluster_traversal.cpp",
           "for (std::size_t i = 0; i < arity && children_a[i]", "for (std::size_t i = 1; i < arity && children_a[i]", "collision",
           "ContactSearch.*:InterruptibleSearch.*"),
    Mutant("sweep-optimistic", "the conservative test advances 10 % too far", "collision/ccd/sweep.cpp",
           "double end = free.holds(time) ? free.to : time;", "double end = free.holds(time) ? time + 1.1 * (free.to - time) : time;",
           "collision", "Sweep.*"),
    Mutant("crossing-one-sign-change", "three changes of sign are taken for one", "collision/ccd/crossing.hpp",
           "(b3 < -bound) & ((b1 > bound) | (b2 < -bound));", "(b3 < -bound);",
           "collision", "ExactCcd.*"),
    Mutant("crossing-apart-before", "features apart just before they lie in one plane are taken to be apart in it", "collision/ccd/crossing.hpp",
           "holds_root & (free.from <= from) & (free.to >= to)", "holds_root & (free.from <= from)",
           "collision", "ExactCcd.*"),
    Mutant("one-side-at-start", "features on one side at the start are taken to stay there", "collision/ccd/sweep.cpp",
           "return free.from <= 0.0 && free.to >= 1.0;", "return free.from <= 0.0;", "collision", "Sweep.*"),
    Mutant("cluster-stale-box", "stale box: a cluster's bounds miss its last vertex", "collision/bvh/dop_tree.cpp",
           "for (const Index vertex : touched(c)) join(", "for (const Index vertex : touched(c).first(touched(c).size() - 1)) join(",
           "collision", "ContactSearch.*:InterruptibleSearch.*"),
    Mutant("split-any-diagonal", "a hexahedron's face is cut through its first corner, whatever its neighbour does", "engine/io/split_cells.cpp",
           "if (corners[face[k]] < corners[face[first]]) first = k;", "", "import", "SplitCells.*"),
    Mutant("frames-overflow", "the reader of frames takes an object's number below zero", "engine/io/frames.cpp",
           "frames.objects[v] < 0 || ", "", "engine", "Frames.*"),
    Mutant("state-forgets-hints", "a saved state omits the descent's hints", "engine/state/visit_state.hpp",
           "visitor.list(chain.hint, [&](auto& leaf) { visitor.number(leaf); });", "(void)chain;", "engine", "StateBytes.*:*Resumed*"),
    Mutant("state-forgets-felt", "a saved state omits what tissue felt of a rod", "engine/state/visit_state.hpp",
           "visitor.vector(start_drag), visitor.vector(felt);", "visitor.vector(start_drag), (void)felt;", "engine", "StateBytes.*:*Resumed*"),
    Mutant("state-forgets-rates", "a saved state omits the rates of the stable step", "engine/state/visit_state.hpp",
           "visit_numbers(visitor, elastic, viscous, worst_tet, rates_age, rates_hold, warm, rounds_ahead);", "visit_numbers(visitor, elastic, viscous, worst_tet, rates_age, rates_hold, warm);", "engine", "StateBytes.*:*Resumed*"),
    Mutant("state-forgets-warm", "a saved state omits what a contact pressed with", "engine/state/visit_state.hpp",
           "visitor.number(recovery), visitor.vector(warm), visitor.number(room);", "visitor.number(recovery), visitor.number(room);", "engine", "StateBytes.*:*Resumed*"),
    Mutant("state-forgets-flow", "a saved state omits the turns of the blood's centreline", "engine/state/visit_state.hpp",
           "visit_frames(visitor, frames), visit_frames(visitor, flow_frames);", "visit_frames(visitor, frames);", "engine", "StateBytes.*:*Resumed*"),
    Mutant("state-forgets-inside", "a saved state omits that a rod was seen inside", "engine/state/visit_state.hpp",
           "visit_numbers(visitor, drive_stopped, kept_inside, exact_candidates);", "visit_numbers(visitor, drive_stopped, exact_candidates);", "engine", "StateBytes.*:*Resumed*"),
    Mutant("viscosity-once", "drag counts the viscosity once, not twice", "fem/tissue/tet_laws-inl.hpp",
           "const V twice = hn::Add(viscosity, viscosity);\n    const auto diagonal", "const V twice = viscosity;\n    const auto diagonal", "fem",
           "Damping.Drag*"),
    Mutant("budget-one-more", "a budget of work may be overspent by one unit", "engine/time/step_budget.cpp",
           "limits_.work_units > gone ? limits_.work_units - gone : 0",
           "limits_.work_units >= gone ? limits_.work_units - gone + 1 : 0", "engine", "StepBudget.*:Wire.*"),
    Mutant("ahead-of-the-clock", "with every command the viewer's simulation gets farther ahead of the clock", "engine/viewer/loop.cpp",
           "(!commanded || ahead)", "!commanded", "viewer", "ViewerServer.StepsOf*"),
]


def find_loss(mutant):
    """What is wrong with its place; empty: it is there, once."""
    count = (ROOT / mutant.file).read_text().count(mutant.old)
    return "" if count == 1 else f"{mutant.name}: its place occurs {count} times in {mutant.file}"


def run(command, cwd, limit=None):
    """Exit code and output; a time limit counts as a failure."""
    try:
        done = subprocess.run(command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                              timeout=limit, check=False)
        return done.returncode, done.stdout
    except subprocess.TimeoutExpired:
        return 124, "ran into the time limit"


def copy_sources(work):
    """The tracked files as they are now, times kept where nothing changed."""
    files = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT, stdout=subprocess.PIPE,
                           check=True).stdout.decode().split("\0")
    wanted = {name for name in files if name and (ROOT / name).is_file()}
    for name in wanted:
        source, target = ROOT / name, work / name
        data = source.read_bytes()
        if target.is_file() and target.read_bytes() == data:
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)
        target.chmod(source.stat().st_mode & 0o777)
    for old in work.rglob("*"):
        relative = old.relative_to(work)
        if old.is_file() and relative.parts[0] != "build" and str(relative) not in wanted:
            old.unlink()


class CopiedTree:
    """Mutants in a copy of the sources, built by its own ninja."""

    def __init__(self, work, jobs, modules):
        self.work, self.jobs, self.build = work, jobs, work / "build" / "mutants"
        work.mkdir(parents=True, exist_ok=True)
        copy_sources(work)
        code, output = run(["cmake", "--preset", "release", "-B", str(self.build)], work)
        if code != 0:
            sys.exit(output)
        print(f"building {', '.join(modules)} ...", flush=True)
        code, output = self.make(modules)
        if code != 0:
            sys.exit(output[-4000:])

    def make(self, modules):
        return run(["ninja", "-C", str(self.build), f"-j{self.jobs}"] + [f"test_{module}" for module in modules], self.work)

    def unchanged(self, module):
        return find_program(self.build, module)

    def mutated(self, mutant, text):
        """Exit code, output, and the program; the copy's file is broken until `restore`."""
        (self.work / mutant.file).write_text(text)
        return *self.make([mutant.module]), find_program(self.build, mutant.module)

    def restore(self, mutant):
        (self.work / mutant.file).write_bytes((ROOT / mutant.file).read_bytes())


class FinishedBuild:
    """Mutants linked before the libraries of a build that is there."""

    def __init__(self, build, work):
        self.build, self.work = build.resolve(), work
        work.mkdir(parents=True, exist_ok=True)
        self.commands = {entry["file"]: entry for entry in json.loads((self.build / "compile_commands.json").read_text())}

    def link(self, module, first, program):
        listed = run(["ninja", "-t", "commands", f"tests/{module}/test_{module}"], self.build)[1]
        words = shlex.split(listed.strip().splitlines()[-1].replace(": &&", "").replace("&& :", ""))
        words[words.index("-o") + 1] = str(program)
        return run(words[:1] + first + words[1:], self.build)

    def unchanged(self, module):
        program = self.work / f"test_{module}"
        code, output = self.link(module, [], program)
        if code != 0:
            sys.exit(output[-4000:])
        return program

    def mutated(self, mutant, text):
        program, objects = self.work / f"mutant_{mutant.module}", []
        broken = self.work / "broken" / mutant.file  # found before the sound one where it is included
        broken.parent.mkdir(parents=True, exist_ok=True)
        broken.write_text(text)
        code, output = 0, ""
        for unit in dict.fromkeys(self.find_unit(mutant, file) for file in self.translated(mutant)):
            objects.append(str(self.work / f"mutant_{len(objects)}.o"))
            code, output = self.compile(mutant, unit, objects[-1])
            if code != 0:
                break
        broken.unlink()
        if code == 0:
            code, output = self.link(mutant.module, objects, program)
        return code, output, program

    @staticmethod
    def translated(mutant):
        """The file itself, or those that include it."""
        if mutant.file.endswith(".cpp"):
            return [mutant.file]
        wanted = f'#include "{mutant.file}"'
        folder = ROOT / Path(mutant.file).parts[0]
        return [str(f.relative_to(ROOT)) for f in sorted(folder.rglob("*.cpp")) if wanted in f.read_text()]

    def find_unit(self, mutant, file):
        """The source that is compiled: the file, or the unity source that includes it."""
        for name in self.commands:
            if name.endswith("/" + file):
                return name
        for name in self.commands:
            if name.endswith("_cxx.cxx") and f'/{file}"' in Path(name).read_text():
                return name
        sys.exit(f"{mutant.name}: {file} is not compiled")

    def compile(self, mutant, unit, thing):
        entry = self.commands[unit]
        words = shlex.split(entry["command"])
        source, broken = Path(unit), self.work / "broken" / mutant.file
        if mutant.file.endswith(".cpp") and unit.endswith("/" + mutant.file):
            source = broken
        elif unit.endswith("_cxx.cxx"):
            source = self.work / Path(unit).name
            source.write_text(Path(unit).read_text().replace(f'"{ROOT / mutant.file}"', f'"{broken}"'))
        words[words.index("-o") + 1], words[words.index("-c") + 1] = thing, str(source)
        words.insert(1, f"-I{self.work / 'broken'}")
        return run(words + ["-O0", "-g0", "-Wno-invalid-pch"], entry["directory"])

    def restore(self, mutant):
        pass


VISITOR = "engine/state/visit_state.hpp"


def guard_visits(text):
    """The state's visitor with every visit of a member under a switch, and what each switch leaves out."""
    members = []

    def guard(call, what):
        members.append(what)
        return f"(keeps_member({len(members) - 1}) ? void({call}) : void())"

    def guard_call(match):
        function, arguments = match.group(1), match.group(2)
        if function == "visit_numbers":
            names = [name.strip() for name in arguments.split(",")[1:]]
            return ", ".join(guard(f"visitor.number({name})", name) for name in names)
        return guard(match.group(0), arguments.split(",")[-1].strip())

    head, body = text.split("template <class Visitor, class Frames>", 1)  # before it stand the visits' own tools
    visit = r"(?<!void )\b(visit_numbers|visit_points|visit_frames|visit_springs|visit_stable_step|visit_follow|visitor\.number|" \
            r"visitor\.vector)\(((?:[^()]|\(\))*)\)(?=[;,])"
    body = re.sub(visit, guard_call, body)
    switch = """inline bool keeps_member(int member) {
    const char* left_out = std::getenv("TROCAR_LEFT_OUT");
    return left_out == nullptr || std::atoi(left_out) != member;
}

"""
    return head.replace("namespace trocar::engine {", "#include <cstdlib>\n\nnamespace trocar::engine {\n\n" + switch, 1) + \
        "template <class Visitor, class Frames>" + body, members


def try_members(build, work):
    """How many members of the state may be left out of its visitor without a test of its bytes failing. One program for all of them."""
    text, members = guard_visits((ROOT / VISITOR).read_text())
    code, output, program = FinishedBuild(build, work).mutated(Mutant("members", "", VISITOR, "", "", "engine", "StateBytes.*"), text)
    if code != 0:
        sys.exit(output[-3000:])
    survived = []
    for member in range(-1, len(members)):
        done = subprocess.run([str(program), "--gtest_filter=StateBytes.*", "--gtest_brief=1"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              env={**os.environ, "TROCAR_LEFT_OUT": str(member)}, check=False)
        if member < 0 and done.returncode != 0:
            sys.exit("StateBytes.* does not pass unchanged")
        if member >= 0 and done.returncode == 0:
            survived.append(members[member])
    print(f"{len(members)} members left out one at a time, {len(survived)} not noticed: {', '.join(survived) or 'none'}")
    return len(survived)


def find_program(build, module):
    return build / "tests" / module / f"test_{module}"


def run_tests(program, pattern, limit):
    return run([str(program), f"--gtest_filter={pattern}", "--gtest_brief=1"], program.parent, limit)


def first_failure(output):
    for line in output.splitlines():
        if line.startswith("[  FAILED  ]"):
            return line.split("]", 1)[1].strip().split(" (")[0].split(",")[0]
    return "crash or time limit"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, default=Path("/tmp/trocar-mutants"))
    parser.add_argument("--build", type=Path, help="a finished build of these sources")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--markdown", type=Path)
    parser.add_argument("--places", action="store_true")
    parser.add_argument("--members", action="store_true")
    options = parser.parse_args()
    if options.places:
        lost = [message for message in map(find_loss, MUTANTS) if message]
        sys.exit("\n".join(lost) or 0)
    if options.members:
        if not options.build:
            sys.exit("--members needs --build")
        sys.exit(1 if try_members(options.build, options.work) else 0)
    chosen = [m for m in MUTANTS if not options.only or m.name in options.only]
    if not chosen:
        sys.exit("no such mutant; known: " + ", ".join(m.name for m in MUTANTS))

    modules = sorted({m.module for m in chosen})
    tree = FinishedBuild(options.build, options.work) if options.build else CopiedTree(options.work, options.jobs, modules)
    programs = {module: tree.unchanged(module) for module in modules}
    for module, pattern in sorted({(m.module, m.filter) for m in chosen}):
        code, output = run_tests(programs[module], pattern, LIMIT_S)
        if code != 0 or "Running 0 tests" in output:
            sys.exit(f"test_{module} --gtest_filter={pattern} does not pass unchanged:\n{output[-3000:]}")

    rows, survived = [], 0
    for mutant in chosen:
        sound = (ROOT / mutant.file).read_text()
        if loss := find_loss(mutant):
            sys.exit(loss)
        begun = time.monotonic()
        try:
            code, output, program = tree.mutated(mutant, sound.replace(mutant.old, mutant.new))
            if code != 0:
                sys.exit(f"{mutant.name} does not compile:\n{output[-3000:]}")
            code, output = run_tests(program, mutant.filter, LIMIT_S)
        finally:
            tree.restore(mutant)
        killer = first_failure(output) if code != 0 else "SURVIVED"
        survived += code == 0
        rows.append((mutant, killer))
        print(f"{mutant.name:28} {killer} ({time.monotonic() - begun:.0f} s)", flush=True)

    print(f"{len(rows)} mutants, {survived} survived")
    if options.markdown:
        lines = ["| broken on purpose | where | test that fails |", "| --- | --- | --- |"]
        lines += [f"| {m.what} | `{m.file}` | `{killer}` |" for m, killer in rows]
        options.markdown.write_text("\n".join(lines) + "\n")
    sys.exit(1 if survived else 0)


if __name__ == "__main__":
    main()
