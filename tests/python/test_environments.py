"""Environments, batches and rollouts, with and without Gymnasium's API."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import threading

import numpy as np
import pytest

import gymnasium
import trocar
import trocar.anatomy
import trocar.gym
from conftest import PROGRAM, box_vessel
from gymnasium.utils.env_checker import check_env

QUICK = trocar.Options(start_poses=3)


def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1])


@pytest.fixture(scope="module")
def task(arch):
    return trocar.Task(arch, QUICK)


@pytest.fixture(scope="module")
def tube_task(tube):
    return trocar.Task(tube, trocar.Options(start_poses=2, time_limit=2.0))


def roll(environments, steps, seed=0):
    """Hashes and rewards of random actions, the same for each environment whatever their number."""
    environments.reset(seed)
    generators = [np.random.default_rng(i) for i in range(environments.num_envs)]
    rows = []
    for _ in range(steps):
        actions = np.array([g.uniform([-10, -3], [35, 3], (environments.devices, 2)) for g in generators])
        _, reward, terminated, truncated, infos = environments.step(actions)
        rows.append((infos["hash"].tolist(), reward.tolist(), terminated.tolist(), truncated.tolist()))
    return rows


def test_an_answer_that_somebody_holds_is_never_written_again(tube_task):
    environments = trocar.Environments(tube_task, 5, 1)
    environments.reset(0)
    random = np.random.default_rng(1)
    hold = {  # what a caller keeps of an answer
        "everything": lambda a: (a, [np.array(x) for x in (*a[:4], *a[4].values())], lambda a: [*a[:4], *a[4].values()]),
        "a row": lambda a: (a[0][2], [a[0][2].copy()], lambda row: [row]),
        "a view of a view of an info": lambda a: (a[4]["force"][1:][::2], [a[4]["force"][1:][::2].copy()], lambda view: [view]),
        "the dict": lambda a: (a[4], [np.array(x) for x in a[4].values()], lambda infos: list(infos.values())),
        "a memoryview": lambda a: (memoryview(a[1]), [a[1].copy()], lambda view: [np.asarray(view)]),
        "nothing": lambda a: (None, [], lambda nothing: []),
    }
    held = []
    for _ in range(120):
        answer = environments.step(random.uniform([0.0, -2.0], [20.0, 2.0], (5, 1, 2)))
        held.append(hold[random.choice(list(hold))](answer))
        del answer
        for _ in range(random.integers(2)):
            held.pop(random.integers(len(held)))
    for kept, copies, read in held:
        now = read(kept)
        assert len(now) == len(copies) and all(np.array_equal(x, y, equal_nan=x.dtype.kind == "f") for x, y in zip(now, copies))


def test_an_answer_that_was_changed_is_not_given_again(tube_task):
    environments, other = (trocar.Environments(tube_task, 5, 1) for _ in range(2))
    for each in (environments, other):
        each.reset(0)
    actions = np.full((5, 1, 2), 7.0)

    def reshape(answer):
        answer[0].shape = (-1,)

    def lock(answer):
        answer[1].flags.writeable = False

    def retype(answer):
        answer[4]["exits"].dtype = np.int64

    def empty(answer):
        answer[4].clear()

    def reverse(answer):
        answer[4]["force"].strides = (0,)

    for change in (reshape, lock, retype, empty, reverse) * 3:
        change(environments.step(actions))
        expected = other.step(actions)
    for _ in range(6):
        found, expected = environments.step(actions), other.step(actions)
        for mine, yours in zip((*found[:4], *found[4].values()), (*expected[:4], *expected[4].values())):
            assert mine.shape == yours.shape and mine.dtype == yours.dtype and mine.flags.writeable == yours.flags.writeable
            assert np.array_equal(mine, yours)
        assert list(found[4]) == list(expected[4])


def test_answers_that_nobody_holds_take_no_new_memory(tube_task):
    environments = trocar.Environments(tube_task, 5, 1)
    environments.reset(0)
    actions, places = np.zeros((5, 1, 2)), set()
    for _ in range(20):
        answer = environments.step(actions)
        places.add(answer[0].ctypes.data)
    assert len(places) <= 3


def test_the_single_environment_keeps_gymnasiums_rules(task):
    env = trocar.gym.Navigation(task)
    check_env(env)
    assert env.action_space.shape == (1, 2) and env.action_space.high[0].tolist() == pytest.approx([35.0, 3.14])


def test_make_and_make_vec_find_the_environments():
    env = gymnasium.make("trocar.gym:SceneNav-v0", scene=box_vessel(), start_poses=1)
    observation, info = env.reset(seed=3)
    assert observation.shape == (2 * 3 * 3 + 3 + 4,) and info["target"] == "end" and len(info["hash"]) == 16 and info["failure"] == ""
    several = gymnasium.make_vec("trocar.gym:SceneNav-v0", num_envs=3, vectorization_mode="vector_entry_point", scene=box_vessel(),
                                 num_threads=2, start_poses=1)
    observations, infos = several.reset(seed=3)
    assert observations in several.observation_space and observations.shape == (3, 25) and infos["_hash"].all()
    assert several.metadata["autoreset_mode"] == gymnasium.vector.AutoresetMode.NEXT_STEP
    result = several.step(several.action_space.sample())
    assert len(result) == 5 and result[1].dtype == np.float64 and result[2].dtype == result[3].dtype == np.bool_
    with pytest.raises(TypeError, match="tolerance"):
        trocar.gym.Navigation(box_vessel(), tolerence=3.0)


def test_the_absence_of_gymnasium_is_one_sentence():
    code = "import sys; sys.modules['gymnasium'] = None\nimport trocar\ntry:\n    import trocar.gym\nexcept ImportError as e:\n    print(e)"
    said = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert said.startswith("trocar.gym needs Gymnasium") and said.count("\n") == 1


def test_a_seed_decides_everything(task):
    env = trocar.gym.Navigation(task)
    drawn = set()
    for seed in range(12):
        first, info = env.reset(seed=seed)
        again, info_again = env.reset(seed=seed)
        assert (first == again).all() and info == info_again
        drawn.add((info["target"], info["start"]))
    assert len(drawn) > 4 and len({target for target, _ in drawn}) == 3
    env.reset(seed=5)
    following = [env.reset()[1]["hash"] for _ in range(3)]
    env.reset(seed=5)
    assert following == [env.reset()[1]["hash"] for _ in range(3)]


def test_an_episode_ends_at_the_target_and_pays_for_the_way(tube_task):
    env = trocar.gym.Navigation(tube_task)
    _, info = env.reset(seed=1)
    way, total, steps = info["remaining"], 0.0, 0
    while True:
        _, reward, terminated, truncated, info = env.step([[35.0, 0.0]])
        total, steps = total + reward, steps + 1
        assert reward == pytest.approx(sum(info["reward_terms"].values())) and info["exits"] == 0
        if terminated or truncated:
            break
    assert terminated and info["success"] and info["distance"] <= 0.005 and not truncated
    assert total == pytest.approx(10.0 * (way - info["remaining"]) + 1.0 - 0.005 * steps)
    with pytest.raises(RuntimeError, match="reset"):
        env.step([[0.0, 0.0]])


def test_an_episode_is_truncated_at_its_time_limit(tube_task):
    env = trocar.gym.Navigation(tube_task)
    env.reset(seed=1)
    ends = [env.step([[0.0, 0.0]])[2:4] for _ in range(tube_task.action_limit)]
    assert ends == [(False, False)] * (tube_task.action_limit - 1) + [(False, True)] and tube_task.action_limit == 15


def test_tracked_points_remember(task):
    env = trocar.gym.Navigation(task)
    before, _ = env.reset(seed=2)
    assert (before[:9] == before[9:18]).all()
    after, *_ = env.step([[35.0, 1.0]])
    assert (after[9:18] == before[:9]).all() and not (after[:9] == before[:9]).all()
    tip = env.environments.rods(0)[0][-1]
    assert after[:3] == pytest.approx(1e3 * tip, abs=1e-3) and np.linalg.norm(after[:3] - after[3:6]) == pytest.approx(2.0, abs=1e-3)
    assert after[-4:-2].tolist() == pytest.approx([35.0, 1.0])


def test_threads_batches_and_launches_give_the_same_bits(task):
    alone = roll(trocar.Environments(task, 4, 1), 12)
    assert roll(trocar.Environments(task, 4, 2), 12) == alone
    assert roll(trocar.Environments(task, 4, 3, copy=False), 12) == alone
    single = trocar.Environments(task, 1, 1)
    for i in range(4):
        single.reset(i)
        generator = np.random.default_rng(i)
        for row in alone:
            infos = single.step(generator.uniform([-10, -3], [35, 3], (1, 1, 2)))[4]
            assert infos["hash"][0] == row[0][i]


def test_next_step_resets_in_the_action_after_the_end(tube_task):
    environments = trocar.Environments(tube_task, 2, 2, autoreset="next_step")
    environments.reset(7)
    push = np.array([[[35.0, 0.0]], [[0.0, 0.0]]])
    while True:
        observation, reward, terminated, truncated, _ = environments.step(push)
        if terminated[0]:
            break
    assert not terminated[1] and not truncated[1]
    begun, reward, terminated, truncated, infos = environments.step(push)
    assert reward[0] == 0.0 and not terminated[0] and not truncated[0] and reward[1] != 0.0
    assert infos["distance"][0] > 0.03 and "final_obs" not in infos and begun[0, -2] < 20.0


def test_same_step_resets_at_once_and_gives_the_final_observation(tube_task):
    environments = trocar.Environments(tube_task, 2, 2, autoreset="same_step")
    environments.reset(7)
    push = np.array([[[35.0, 0.0]], [[0.0, 0.0]]])
    while True:
        observation, reward, terminated, truncated, infos = environments.step(push)
        if terminated[0]:
            break
    assert infos["_final_obs"].tolist() == [True, False] and infos["final_obs"][1] is None
    final = infos["final_obs"][0]
    assert np.linalg.norm(final[:3] - final[18:21]) <= 5.0 < np.linalg.norm(observation[0, :3] - observation[0, 18:21])
    assert infos["success"][0] and infos["distance"][0] <= 0.005
    assert "final_obs" not in environments.step(push)[4]


def test_a_mask_resets_some(task):
    environments = trocar.Environments(task, 3, 2, autoreset="disabled")
    before, infos = environments.reset(1)
    moved = environments.step(np.full((3, 1, 2), 10.0))[0]
    after, infos = environments.reset([None, 2, None], np.array([False, True, False]))
    assert (after[[0, 2]] == moved[[0, 2]]).all() and (after[1] == before[1]).all()
    for mask in ([1, 0, 1], np.ones(2, dtype=bool)):
        with pytest.raises(ValueError, match="mask"):
            environments.reset(mask=mask)
    for word, mode in (("next_step", gymnasium.vector.AutoresetMode.NEXT_STEP), ("same_step", gymnasium.vector.AutoresetMode.SAME_STEP)):
        assert trocar.gym.VectorEnv(task, 2, autoreset=word).metadata["autoreset_mode"] == mode, "the word of trocar.Environments does as well"
    with pytest.raises(ValueError, match="autoreset: found 'x', expected"):
        trocar.gym.VectorEnv(task, 2, autoreset="x")
    gym_environments = trocar.gym.VectorEnv(task, 3, autoreset=gymnasium.vector.AutoresetMode.DISABLED)
    first, _ = gym_environments.reset(seed=1)
    gym_environments.step(np.full((3, 1, 2), 10.0))
    third, _ = gym_environments.reset(seed=1, options={"reset_mask": np.array([True, False, False])})
    assert (third[0] == first[0]).all() and not (third[1] == first[1]).all()


def test_anatomies_may_differ(task):
    other = trocar.Task(trocar.anatomy.random_arch(3), QUICK)
    environments = trocar.Environments([task, other], 4, 2)
    environments.reset(0)
    assert [environments.episode(i)[0] for i in range(4)] == ["aortic-arch", "arch-3"] * 2
    rows = roll(environments, 6)
    assert rows == roll(trocar.Environments([task, other], 4, 1), 6)
    env = trocar.gym.Navigation([task, other])
    assert {env.reset(seed=s)[1]["scene"] for s in range(8)} == {"aortic-arch", "arch-3"}
    assert trocar.anatomy.random_arch(3) == trocar.anatomy.random_arch(3) != trocar.anatomy.random_arch(4)


def test_hostile_actions_have_a_clear_answer(task):
    environments = trocar.Environments(task, 2, 2)
    with pytest.raises(trocar.Error, match="reset"):
        environments.step(np.zeros((2, 1, 2)))
    environments.reset(0)
    hashes = environments.step(np.zeros((2, 1, 2)))[4]["hash"]
    bad = [(np.full((2, 1, 2), np.nan), ValueError), (np.full((2, 1, 2), np.inf), ValueError), (np.zeros((2, 2)), ValueError),
           (np.zeros((3, 1, 2)), ValueError), (np.zeros((2, 1, 2), dtype=complex), TypeError), (np.array([[["a", "b"]]] * 2), TypeError),
           (None, TypeError), (np.zeros((2, 1, 2), dtype=object), TypeError), (np.zeros((2, 1, 2), dtype=bool), TypeError)]
    for actions, kind in bad:
        with pytest.raises(kind, match="expected"):
            environments.step(actions)
    same = [np.full((2, 1, 2), 7.0, dtype=">f8"), np.full((2, 1, 2), 7, dtype=np.int16), np.full((1, 2, 2), 7.0, dtype=">f4").transpose(1, 0, 2),
            np.full((4, 1, 4), 7.0)[::2, :, ::2]]
    ends = set()
    for actions in same:
        environments.reset(0)
        environments.step(np.zeros((2, 1, 2)))
        ends.add(tuple(environments.step(actions)[4]["hash"].tolist()))
    assert len(ends) == 1 and tuple(hashes.tolist()) not in ends
    for make in (lambda: trocar.Environments(task, 0), lambda: trocar.Environments(task, 1, 0), lambda: trocar.Environments(task, autoreset="x"),
                 lambda: trocar.Environments([]), lambda: environments.reset([1]), lambda: environments.reset(-1),
                 lambda: trocar.Task(task.scene, trocar.Options(targets=["toe"])), lambda: trocar.Task(task.scene, trocar.Options(hold=0.0)),
                 lambda: trocar.Task(task.scene, trocar.Options(points=0)), lambda: trocar.Task(task.scene, trocar.Options(budget="soon")),
                 lambda: trocar.Task("falling_sphere"), lambda: environments.rods(2)):
        with pytest.raises(ValueError):
            make()


def test_one_thread_at_a_time(task):
    environments = trocar.Environments(task, 8, 2)
    environments.reset(0)
    answers = []

    def use():
        for _ in range(5):
            try:
                environments.step(np.full((8, 1, 2), 20.0))
                answers.append("stepped")
            except trocar.Error as error:
                answers.append(str(error))

    threads = [threading.Thread(target=use) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert "stepped" in answers and all(a == "stepped" or "in use by another thread" in a for a in answers)


def test_a_forked_process_is_told_that_it_has_no_threads(task):
    environments = trocar.Environments(task, 4, 2)
    environments.reset(0)
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            environments.step(np.zeros((4, 1, 2)))
            os.write(write, b"stepped")
        except trocar.Error as error:
            os.write(write, str(error).encode())
        finally:
            del environments
            os._exit(0)
    os.close(write)
    said = b""
    while block := os.read(read, 4096):
        said += block
    os.close(read)
    assert os.waitpid(child, 0)[1] == 0 and b"spawn" in said
    environments.step(np.zeros((4, 1, 2)))


def _hash_after(scene):
    environments = trocar.Environments(trocar.Task(scene, QUICK), 2, 2)
    return roll(environments, 2)[-1]


def test_a_spawned_process_comes_to_the_same_bits(tube):
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.apply(_hash_after, (tube,))
    assert there == _hash_after(tube)


def test_episodes_come_and_go_without_leaving_memory(tube_task):
    environments = trocar.Environments(tube_task, 4, 1)
    for seed in range(50):
        environments.reset(seed)
    before = resident()
    for seed in range(250):
        environments.reset(seed)
    assert resident() <= 1.01 * before


def test_environments_of_one_scene_share_its_model():
    from trocar.bench import _alone, memory

    assert _alone(memory, "aortic_arch", 12) < 64.0  # MB each


def test_hashes_do_not_depend_on_launches_or_threads(tube):
    """Ten processes, every other one on two threads."""
    program = ("import pickle, sys, numpy as np, trocar\n"
               "task = trocar.Task(pickle.loads(sys.stdin.buffer.read()), trocar.Options(start_poses=2))\n"
               "environments = trocar.Environments(task, 4, int(sys.argv[1]))\n"
               "environments.reset(0)\n"
               "random = np.random.default_rng(0)\n"
               "for _ in range(6):\n"
               "    infos = environments.step(random.uniform([-10, -3], [35, 3], (4, 1, 2)))[4]\n"
               "print(infos['hash'].tolist())\n")
    import pickle
    told = {subprocess.run([sys.executable, "-c", program, str(1 + launch % 2)], input=pickle.dumps(tube), capture_output=True, check=True).stdout
            for launch in range(10)}
    assert len(told) == 1 and len(told.pop()) > 40


def test_a_batch_takes_any_array_of_numbers_and_answers_in_arrays_of_its_own(tube_task):
    actions = np.random.default_rng(0).uniform([-10, -3], [35, 3], (3, 4, 1, 2)).astype(np.float32)
    ways = [lambda a: a.astype(np.float64), lambda a: a, lambda a: a.tolist(), lambda a: np.asfortranarray(a), lambda a: a.astype(">f8")]
    hashes = set()
    for way in ways:
        environments = trocar.Environments(tube_task, 4, 1)
        environments.reset(0)
        answers = [environments.step(way(a)) for a in actions]
        hashes.add(tuple(answers[-1][4]["hash"].tolist()))
        assert not np.shares_memory(answers[0][0], answers[1][0]) and (answers[0][0] != answers[1][0]).any()
    assert len(hashes) == 1
    shown = trocar.Environments(tube_task, 4, 1, copy=False)
    shown.reset(0)
    first, second = (shown.step(a.astype(np.float64)) for a in actions[:2])
    assert np.shares_memory(first[0], second[0]) and not first[0].flags.writeable and not first[4]["hash"].flags.writeable


def test_a_masked_reset_leaves_the_rows_of_others(tube_task):
    environments = trocar.Environments(tube_task, 3, 1, autoreset="disabled")
    environments.reset(0)
    told, *_, infos = environments.step(np.full((3, 1, 2), 20.0))
    observations = told.copy()
    told[:] = 0.0  # an answer is its user's to change
    again, infos_again = environments.reset(mask=np.array([False, True, False]))
    assert (again[[0, 2]] == observations[[0, 2]]).all() and (again[1] != observations[1]).any()
    assert infos_again["hash"][0] == infos["hash"][0] and infos_again["hash"][1] != infos["hash"][1]


def test_a_rollout_is_what_a_simulator_would_do(arch):
    sim = arch.simulator()
    sim.drive(0, speed=0.03)
    sim.step(100)
    state = sim.save()
    actions = np.random.default_rng(0).uniform([-10, -3], [35, 3], (6, 4, 1, 2))
    one, two = (trocar.rollout(arch, state, actions, num_threads=n, keep_states=True) for n in (1, 2))
    assert (one.hash == two.hash).all() and (one.tip == two.tip).all() and (one.done == 4).all() and one.tip.shape == (6, 4, 1, 3)
    sim.load(state)
    for speed, turn in actions[3, :, 0]:
        sim.drive(0, speed=1e-3 * speed, turn=turn)
        report = sim.step(13)
    assert sim.hash == f"{int(one.hash[3]):016x}" and (report.tip == one.tip[3, -1, 0]).all() and one.states[3].hash == sim.hash
    again = trocar.rollout(arch, one.states, actions[:, :1])
    assert again.done.tolist() == [1] * 6
    for bad in (actions[:, :, 0], actions[..., :1], np.full_like(actions, np.nan)):
        with pytest.raises(ValueError, match="expected"):
            trocar.rollout(arch, state, bad)
    with pytest.raises(ValueError, match="states"):
        trocar.rollout(arch, [state] * 2, actions)


def test_environments_of_organs_that_move_follow_their_targets(hepatic):
    task = trocar.Task(hepatic, trocar.Options(start_poses=1, budget="work:20000"))
    environments = trocar.Environments(task, 1, 1)
    first, _ = environments.reset(0)
    for _ in range(3):
        later, reward, *_ = environments.step(np.zeros((1, 1, 2)))
    assert np.isfinite(later).all() and (later >= task.low).all() and (later <= task.high).all()
    assert 0.1 < np.linalg.norm(later[0, 18:21] - first[0, 18:21]) < 20.0  # it breathes
    assert environments.save(0).step == 39


def test_a_recorded_episode_is_scored_and_an_edited_byte_is_found(tube_task, tmp_path):
    if not PROGRAM:
        pytest.skip("TROCAR_PROGRAM does not name the program")

    def score(folder, *more):
        return subprocess.run([PROGRAM, "score", folder, *more], capture_output=True, text=True)

    env = trocar.gym.Navigation(tube_task)
    env.record(tmp_path / "ep")
    env.reset(seed=4)
    generator = np.random.default_rng(4)
    while True:
        *_, terminated, truncated, info = env.step(np.array([[30.0, generator.uniform(-2, 2)]], dtype=np.float32))
        if terminated or truncated:
            break
    said = score(tmp_path / "ep")
    assert said.returncode == 0, said.stderr
    assert "success yes, safe success yes" in said.stdout and f"state {info['hash']}" in said.stdout and "exits 0" in said.stdout
    assert "safe success no" in score(tmp_path / "ep", "--force-limit", "0").stdout or info["force"] == 0.0
    for file in sorted((tmp_path / "ep").iterdir()):
        data = file.read_bytes()
        for place in (0, len(data) // 2, len(data) - 1):
            file.write_bytes(data[:place] + bytes([data[place] ^ 1]) + data[place + 1:])
            assert score(tmp_path / "ep").returncode == 5, (file.name, place)
        file.write_bytes(data)
    # an action that was changed together with all hashes of files is found by simulating it
    csv, manifest = tmp_path / "ep" / "actions.csv", tmp_path / "ep" / "manifest.json"
    was = trocar._engine.hash_bytes(csv.read_bytes())
    csv.write_text(csv.read_text().replace("30.0,", "31.0,", 1))
    manifest.write_text(manifest.read_text().replace(was, trocar._engine.hash_bytes(csv.read_bytes())))
    (tmp_path / "ep" / "manifest.hash").write_text(trocar._engine.hash_bytes(manifest.read_bytes()) + "\n")
    said = score(tmp_path / "ep")
    assert said.returncode == 5 and "actions.csv:2" in said.stderr
    with pytest.raises(FileExistsError):
        env.record(tmp_path / "ep")
    with pytest.raises(ValueError, match="clock"):
        trocar.gym.Navigation(box_vessel(), budget="5ms", start_poses=1).record(tmp_path / "other")
