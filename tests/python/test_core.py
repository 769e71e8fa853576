"""The package trocar: scenes, simulators, views, states."""

from __future__ import annotations

import copy
import gc
import json
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

import trocar
from conftest import PROGRAM, SOURCE


@pytest.mark.parametrize("name, steps", [("u_bend", 150), ("hepatic", 40), ("guidewire", 60)])
def test_a_run_ends_in_the_command_lines_bits(name, steps, tmp_path):
    if not PROGRAM:
        pytest.skip("TROCAR_PROGRAM does not name the program")
    scene = SOURCE / "assets" / "scenes" / f"{name}.json"
    subprocess.run([PROGRAM, "run", scene, "-n", str(steps), "--budget", "work:20000", "--no-pictures", "--quiet", "--out", tmp_path / "out"],
                   check=True, capture_output=True)
    said = json.loads((tmp_path / "out" / "summary.json").read_text())["state_hash"]
    sim = trocar.load(scene, budget="work:20000").simulator()
    sim.step(steps)
    assert sim.hash == said
    again = sim.scene.simulator()  # the scene keeps those that were given back
    again.step(steps)
    del again
    recycled = sim.scene.simulator()
    recycled.step(steps)
    assert recycled.hash == said


def test_a_step_tells_what_it_did(arch):
    sim = arch.simulator()
    sim.drive("catheter", speed=0.03, turn=1.0)
    report = sim.step()
    assert report.step == 1 and report.time == pytest.approx(0.01) and report.exact and report.finite
    assert report.insertion == pytest.approx(0.008 + 0.0003) and report.rotation == pytest.approx(0.01)
    assert report.tip.shape == (3,) and report.exits == 0 and report.failure == "" and set(report.ms) >= {"fem", "total"}


def test_held_commands_go_on_until_they_are_changed_or_released(tube):
    sim = tube.simulator()
    sim.drive(0, speed=0.02)
    assert sim.step(10).insertion == pytest.approx(0.008 + 0.002)
    sim.drive(0, speed=-0.02)
    assert sim.step(10).insertion == pytest.approx(0.008)
    sim.release(0)
    assert sim.step(5).insertion == pytest.approx(0.008)  # its script: none, so it stays


def test_a_fork_and_a_restored_state_go_on_to_the_same_bits(arch):
    sim = arch.simulator()
    sim.drive(0, speed=0.03, turn=0.5)
    sim.step(120)
    state, fork = sim.save(), sim.fork()
    sim.step(60)
    fork.step(60)
    assert fork.hash == sim.hash != state.hash
    sim.load(state)
    assert sim.hash == state.hash and sim.report.step == 120
    sim.step(60)
    assert sim.hash == fork.hash


def test_launches_and_threads_give_the_same_bits(arch):
    def run(out, k):
        sim = arch.simulator()
        sim.drive(0, speed=0.03)
        sim.step(80)
        out[k] = sim.hash

    hashes = {}
    threads = [threading.Thread(target=run, args=(hashes, k)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    code = ("import trocar; s = trocar.load(trocar.scene_path('aortic_arch'), budget='work:20000').simulator(); "
            "s.drive(0, speed=0.03); s.step(80); print(s.hash)")
    launched = [subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.strip() for _ in range(2)]
    assert len({*hashes.values(), *launched}) == 1 and len(hashes) == 4


def test_instruction_sets_give_the_same_bits(hepatic):
    hashes = {}
    try:
        for isa in ("avx2", "avx512"):
            if trocar._engine.choose_isa(isa):
                sim = hepatic.simulator()
                sim.step(8)
                hashes[isa] = sim.hash
    finally:
        trocar._engine.choose_isa("")
    assert len(set(hashes.values())) <= 1


def test_views_show_the_simulator_in_place_and_cannot_be_written(arch):
    sim = arch.simulator()
    rod, skin, wall = sim.rod(0), sim.skin("catheter"), sim.surface("vessel")
    for view in (rod, skin, wall):
        assert view.dtype == np.float64 and view.shape[1] == 3 and view.flags.c_contiguous and not view.flags.writeable
        assert view.base is not None
        with pytest.raises(ValueError, match="read-only"):
            view[0, 0] = 1.0
        with pytest.raises(ValueError):
            view.flags.writeable = True
    assert rod.__array_interface__["data"][0] == sim.rod(0).__array_interface__["data"][0]
    before = rod[-1].copy()
    sim.drive(0, speed=0.03)
    for _ in range(40):
        report = sim.step()
        assert (rod[-1] == report.tip).all()
    state = sim.save()
    sim.step(20)
    sim.load(state)
    assert (rod[-1] == sim.rod(0)[-1]).all() and not (rod[-1] == before).all()
    assert rod.__array_interface__["data"][0] == sim.rod(0).__array_interface__["data"][0]
    assert arch.triangles("vessel").max() == len(wall) - 1


def test_a_surface_that_moves_is_followed(hepatic):
    sim = hepatic.simulator()
    liver, arteries = sim.surface("liver"), sim.surface("arteries")
    before = liver.copy(), arteries.copy()
    for _ in range(6):
        sim.step()
    other = hepatic.simulator()
    other.step(6)
    assert (liver == other.surface("liver")).all() and (arteries == other.surface("arteries")).all()
    assert not (liver == before[0]).all() and sim.hash == other.hash


def test_views_outlive_the_name_of_their_simulator(tube):
    sim = tube.simulator()
    sim.step(3)
    rod, tip = sim.rod(0), sim.report.tip
    del sim
    gc.collect()
    for _ in range(20):
        tube.simulator()
    assert (rod[-1] == tip).all()


def test_contacts_are_an_array_of_records(arch):
    sim = arch.simulator()
    sim.drive(0, speed=0.035)
    while len(sim.contacts()) == 0:
        assert sim.step(10).time < 6.0
    found = sim.contacts()
    assert np.allclose(np.linalg.norm(found["normal"], axis=1), 1.0) and found["point"].shape == (len(found), 3)
    with pytest.raises(ValueError):
        found["gap"][0] = 0.0


def test_errors_say_file_line_key_and_what_was_expected(tmp_path):
    file = tmp_path / "bad.json"
    file.write_text(open(trocar.scene_path("u_bend")).read().replace('"radius": 0.6', '"radius": -1'))
    with pytest.raises(trocar.Error) as caught:
        trocar.load(file)
    error = caught.value
    assert error.file == str(file) and error.line > 10 and error.key == "instruments.catheter.radius" and error.code == "BadValue"
    assert error.expected and str(error).startswith(f"{file}:{error.line}:")
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
    with pytest.raises(trocar.Error) as caught:
        trocar.load(tmp_path / "none.json")
    assert caught.value.code == "FileNotFound"
    with pytest.raises(trocar.Error, match="budget"):
        trocar.load(trocar.scene_path("u_bend"), budget="fast")
    with pytest.raises(FileNotFoundError, match="aortic_arch"):
        trocar.scene_path("none")


def test_wrong_arguments_have_a_clear_answer(tube, arch):
    sim = tube.simulator()
    for call in (lambda: sim.drive(3), lambda: sim.drive("catheter"), lambda: sim.drive(0, speed=float("nan")),
                 lambda: sim.drive(0, turn=float("inf")), lambda: sim.rod(1), lambda: sim.surface("liver"), lambda: sim.step(-1),
                 lambda: tube.simulator(budget="soon"), lambda: sim.load(arch.simulator().save()), lambda: tube.triangles("liver")):
        with pytest.raises(trocar.Error):
            call()
    with pytest.raises((TypeError, RuntimeError)):
        sim.drive(0, speed="fast")
    with pytest.raises((TypeError, RuntimeError, OverflowError)):
        sim.rod(-1)
    assert sim.report.step == 0


def test_scenes_and_states_are_pickled_within_a_build(tube):
    sim = tube.simulator()
    sim.drive(0, speed=0.02, turn=1.0)
    sim.step(20)
    state = sim.save()
    scene, thawed = pickle.loads(pickle.dumps((tube, state)))
    assert scene.hash == tube.hash and copy.deepcopy(tube) is tube
    other = scene.simulator()
    other.load(thawed)
    assert other.hash == sim.hash
    sim.step(20)
    other.step(20)
    assert other.hash == sim.hash and other.report.rotation > 0.3
    with pytest.raises(TypeError, match="save"):
        pickle.dumps(sim)


def test_pickles_of_another_build_or_other_bytes_are_refused(tube, monkeypatch):
    frozen = pickle.dumps((tube, tube.simulator().save()))
    from trocar import _build
    monkeypatch.setattr(_build, "build_id", lambda: "0" * 32)
    with pytest.raises(ValueError, match="another build"):
        pickle.loads(frozen)
    state = tube.simulator().save()
    bytes_, drives = state._parts()
    changed = bytearray(bytes_)
    changed[len(changed) // 2] ^= 1
    sim = tube.simulator()
    with pytest.raises(trocar.Error, match="changed"):
        sim.load(trocar._engine.saved_state_from(bytes(changed), drives))
    assert sim.step().step == 1


def _hash_of(parts):
    scene, state = parts
    sim = scene.simulator()
    sim.load(state)
    sim.step(10)
    return sim.hash


def test_a_spawned_process_goes_on_to_the_same_bits(tube):
    sim = tube.simulator()
    sim.drive(0, speed=0.02)
    sim.step(10)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.apply(_hash_of, ((tube, sim.save()),))
    sim.step(10)
    assert there == sim.hash


def test_several_threads_may_use_one_simulator(tube):
    sim = tube.simulator()
    sim.drive(0, speed=0.02)
    threads = [threading.Thread(target=lambda: [sim.step() for _ in range(50)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    alone = tube.simulator()
    alone.drive(0, speed=0.02)
    alone.step(200)
    assert sim.hash == alone.hash and sim.report.step == 200


def test_after_a_failure_the_answer_is_clear(tmp_path):
    # a block of tissue that needs more sub-steps than the scene allows
    scene = trocar.load({
        "name": "bursts", "units": {"length": "mm"}, "time": {"step": 0.05, "duration": 1, "max_substeps": 20, "integrator": "rk4"}, "budget": {"limit": "exact"},
        "gravity": [0, 0, -9810],
        "bodies": {"block": {"kind": "deformable", "surface": {"shape": "box", "extent": [20, 20, 20]},
                             "material": {"young_modulus": 1e6, "poisson_ratio": 0.3, "density": 1000},
                             "fixed": [{"direction": [0, 0, 1], "fraction": 0.2}]}},
        "effects": ["elasticity", "gravity"]})
    sim = scene.simulator()
    state = sim.save()
    report = sim.step(5)
    assert not report.finite and report.failure
    with pytest.raises(trocar.StoppedError, match="load"):
        sim.step()
    last = sim.hash
    assert np.isfinite(sim.surface("block")).all() and sim.hash == last
    sim.load(state)
    assert sim.report.step == 0 and sim.hash == state.hash


@pytest.mark.parametrize("what", ["step", "plan", "load"])
def test_an_interruption_ends_a_long_call(what):
    scene, call = {"step": ("u_bend", "scene.simulator().step(10**9)"),
                   "plan": ("hepatic", "trocar.plan(scene, 'tumour', time=1e5)"),  # takes seconds on any machine
                   "load": ("u_bend", "[trocar.load(trocar.scene_path('hepatic'), anatomy_seed=k) for k in range(1000, 2000)]")}[what]
    code = (f"import trocar, sys\nscene = trocar.load(trocar.scene_path('{scene}'), budget='exact')\nprint('ready', flush=True)\n"
            f"try:\n    {call}\nexcept KeyboardInterrupt:\n    print('interrupted', flush=True)\n")
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    try:
        process.stdout.flush()
        threading.Event().wait(0.7)  # into the call
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=120)
    finally:
        process.kill()
    assert out == "interrupted\n" and process.returncode == 0


def test_a_forked_child_may_step_what_no_thread_was_using(tube):
    sim = tube.simulator()
    sim.step(5)
    child = os.fork()
    if child == 0:
        code = 1
        try:
            code = 0 if sim.step().step == 6 else 1
        finally:
            os._exit(code)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def test_explain_says_what_is_simulated(tube):
    text = tube.explain()
    assert "\nsimulated\n" in text and "exact_contact" in text and "predicted" in text and "cost of each effect" in text


def test_a_plan_arrives_and_leads_along_the_centreline(arch):
    plan = trocar.plan(arch, "left_carotid")
    assert plan.arrived and plan.last < 0.003 and plan.exits == 0
    assert plan.path.shape[1] == 3 and (np.diff(plan.path[:, 0]) > 0.0).all()
    assert np.allclose(plan.centreline[-1, :3], arch.targets["left_carotid"], atol=1e-3)
    assert np.allclose(plan.centreline, trocar.centreline(arch, "left_carotid"))
    with pytest.raises(trocar.Error, match="left_carotid"):
        trocar.plan(arch, "toe")
    with pytest.raises(trocar.Error, match="left_carotid"):
        trocar.centreline(arch, "toe")


def tetrahedra():
    v0 = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.2, 0.2, 3], [1.2, 0.2, 3], [0.2, 1.2, 3], [0.2, 0.2, 2]], dtype=float)
    v1 = v0.copy()
    v1[4:, 2] -= 2.5
    return v0, v1, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [4, 5, 6], [4, 7, 5], [4, 6, 7], [5, 7, 6]])


def test_contacts_of_two_frames_are_those_of_the_command_line(tmp_path):
    v0, v1, f = tetrahedra()
    found = trocar.contacts(v0, v1, f)
    assert len(found) > 0 and (found["time"] > 0.0).all() and (found["time"] <= 1.0).all()
    assert set(found["kind"]) <= {b"VF", b"EE"} and np.allclose(np.linalg.norm(found["normal"], axis=1), 1.0)
    two = trocar.contacts(v0[:4], v1[:4], f[:4], (v0[4:], v1[4:], f[4:] - 4), within=False)
    assert len(two) == len(found) and np.allclose(np.sort(two["time"]), np.sort(found["time"]))
    assert (trocar.contacts(v0, v1, f, threads=2) == found).all()
    if not PROGRAM:
        return
    for name, v in (("a0", v0), ("a1", v1)):
        text = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in v.tolist()) + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in f)
        (tmp_path / f"{name}.obj").write_text(text)
    subprocess.run([PROGRAM, "contacts", tmp_path / "a0.obj", tmp_path / "a1.obj", "--out", tmp_path / "c.csv"], check=True, capture_output=True)
    rows = (tmp_path / "c.csv").read_text().splitlines()[1:]
    assert len(rows) == len(found)
    for row, mine in zip(rows, found):
        cells = row.split(",")
        assert cells[0] == mine["kind"].decode() and int(cells[2]) == mine["feature_a"][0] and float(cells[8]) == mine["time"]


def test_foreign_arrays_are_taken_or_refused_with_a_sentence():
    v0, v1, f = tetrahedra()
    expected = trocar.contacts(v0, v1, f)
    assert (trocar.contacts(v0.astype(">f8"), np.asfortranarray(v1), f.astype(">i2")) == expected).all()
    assert (trocar.contacts(v0.astype(np.float32), v1[::1], f[::-1][::-1]) ["kind"] == expected["kind"]).all()
    bad = [((v0.astype(complex), v1, f), TypeError), ((v0.astype(str), v1, f), TypeError), ((v0, v1, f.astype(float)), TypeError),
           ((v0[:, :2], v1, f), ValueError), ((v0, v1[:4], f), ValueError), ((v0, v1, f + 1), ValueError), ((v0, v1, f - 1), ValueError),
           ((v0 * np.nan, v1, f), ValueError), ((v0 * 1e200, v1, f), ValueError), ((v0.ravel(), v1, f), ValueError), ((None, v1, f), TypeError)]
    for arguments, kind in bad:
        with pytest.raises(kind, match="expected|found"):
            trocar.contacts(*arguments)
    with pytest.raises(ValueError, match="distance"):
        trocar.contacts(v0, v1, f, distance=-1.0)


def test_generated_anatomy_follows_its_seed(hepatic):
    assert trocar.load(trocar.scene_path("hepatic"), budget="work:20000").hash == hepatic.hash
    with pytest.raises(trocar.Error, match="recipe"):
        trocar.load(trocar.scene_path("u_bend"), anatomy_seed=3)


def test_many_simulators_come_and_go_without_leaving_memory(tube):
    def resident():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1])

    for _ in range(20):
        tube.simulator().step(2)
    before = resident()
    for _ in range(200):
        tube.simulator().step(2)
    assert resident() < 1.05 * before


def test_a_simulator_is_rendered_as_a_c_arm_sees_it():
    scene = {"name": "ball", "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 1},
             "bodies": {"ball": {"kind": "static", "surface": {"shape": "sphere", "centre": [40, 0, 30], "radius": 12}}}, "effects": [],
             "outputs": {"fluoroscopy": {"views": [{"name": "ap", "pixels": [64, 48]}, {"name": "shown", "pixels": [32, 32], "display": "log"}]}}}
    sim = trocar.load(scene).simulator()
    frame = sim.render()
    assert frame.shape == (48, 64) and frame.dtype == np.uint16 and frame.max() == 65535
    row, column = np.unravel_index(np.argmin(frame), frame.shape)
    assert column < 32 and row < 24  # the patient's right is on the left, the head is up
    assert sim.render("shown").dtype == np.uint8
    assert np.array_equal(sim.render("ap"), frame)
    with pytest.raises(trocar.Error, match="view"):
        sim.render("nobody")
    del scene["outputs"]
    assert trocar.load(scene).simulator().render().min() < 65535
