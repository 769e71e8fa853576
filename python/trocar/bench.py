"""What the Python package costs, measured here: python -m trocar.bench [--quick]"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import platform
import time
from typing import Any, Callable

import numpy as np
from numpy.typing import NDArray

from . import _engine
from ._functions import plan
from .environments import Environments, Options, Task, as_scene


def _resident() -> int:
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def _actions(generators: list[np.random.Generator], devices: int) -> NDArray[np.float64]:
    """Pushing and turning, as on the way to a target."""
    return np.array([g.uniform([10.0, -1.5], [35.0, 1.5], (devices, 2)) for g in generators])


def _wall_and_cpu(work: Callable[[], Any]) -> tuple[float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - cpu


def _plan_actions(task: Task, target: str) -> NDArray[np.float64]:
    """(N, 1, 1, 2) mm/s, rad/s: what `trocar plan` found to go to the target."""
    rows = plan(task.scene, target).path[:: task.steps_per_action]
    speeds = np.diff(rows[:, 1:], axis=0) / np.diff(rows[:, :1], axis=0)
    return np.asarray((speeds * [1e3, 1.0])[:, None, None, :])


def steps_per_second(name: str, seconds: float, target: str = "") -> dict[str, float]:
    """Environment steps of one environment on one thread, exact contacts on: along a plan to the target, or with random pushes and turns."""
    task = Task(name, Options(start_poses=1 if target else 4, tolerance=0.1))
    environments = Environments(task, 1, 1, autoreset="disabled")
    environments.reset(0)
    generators = [np.random.default_rng(0)]
    planned = iter(_plan_actions(task, target)) if target else None
    still = np.zeros((1, task.devices, 2))
    count, contacts, exits, exact, wall, cpu, force = 0, 0, 0, 0, 0.0, 0.0, 0.0
    slowest = 0.0
    while planned is not None or wall < seconds:
        actions = _actions(generators, task.devices) if planned is None else next(planned, still)
        if actions is still:
            break
        took, used = _wall_and_cpu(lambda: environments.step(actions))
        outcome = environments._batch.outcome[0]
        contacts, exits, exact = contacts + int(outcome["contacts"]), exits + int(outcome["exits"]), exact + int(outcome["exact_steps"])
        force, slowest = max(force, float(outcome["force"])), max(slowest, took)
        wall, cpu, count = wall + took, cpu + used, count + 1
    steps = count * task.steps_per_action
    return {"steps": count, "per_second": count / wall, "per_cpu_second": count / cpu, "simulated": task.steps_per_action * task.scene.step,
            "contacts": contacts / steps, "exits": float(exits), "exact": exact / steps, "force": force, "slowest": slowest}


def empty_call() -> float:
    """us, median: what a call of C++ takes that does nothing but walk through memory, beside that walk: Python itself, in emptied caches."""
    rounds = []
    for _ in range(100):
        start = time.perf_counter()
        walked = _engine.walk_memory(96)
        rounds.append(time.perf_counter() - start - walked)
    return 1e6 * float(np.median(rounds))


def batch_overhead(num_envs: int = 64, copy: bool = True) -> float:
    """us, median: what a batch step takes beside the engine's own work, the actions' checks and the making of all answers included."""
    task = Task(_tube(), Options(start_poses=1, hold=0.01, time_limit=1e4))
    environments = Environments(task, num_envs, 1, copy=copy)
    environments.reset(0)
    still, rounds = np.zeros((num_envs, 1, 2)), []
    for _ in range(300):
        start = time.perf_counter()
        environments.step(still)
        rounds.append(time.perf_counter() - start - 1e-3 * environments._batch.engine_ms)
    return 1e6 * float(np.median(rounds))


def _tube() -> dict[str, Any]:
    from .anatomy import shipped

    scene = shipped("straight_tube")
    scene["targets"] = {"end": {"position": [0, 0, 280]}}
    return scene


def scaling(seconds: float, num_envs: int = 16) -> dict[int, tuple[float, float]]:
    """Environment steps on the arch, by threads: a second, and a second of processor time."""
    task = Task("aortic_arch", Options(start_poses=2))
    found = {}
    for threads in sorted({1, 2, os.cpu_count() or 1}):
        environments = Environments(task, num_envs, threads)
        environments.reset(0)
        generators = [np.random.default_rng(i) for i in range(num_envs)]
        rounds = max(2, int(4 * seconds))  # the same episodes for all
        wall, cpu = _wall_and_cpu(lambda: [environments.step(_actions(generators, task.devices)) for _ in range(rounds)])
        found[threads] = rounds * num_envs / wall, rounds * num_envs / cpu
    return found


def reset_and_fork(name: str) -> dict[str, float]:
    """ms, medians."""
    scene = as_scene(name)
    task = Task(scene, Options(start_poses=2))
    environments = Environments(task, 1, 1)
    sim = scene.simulator("exact")
    sim.step(20)
    sim.fork()  # given back at once: the next ones take it
    forks, resets, loads = [], [], []
    state = sim.save()
    for seed in range(30):
        start = time.perf_counter()
        fork = sim.fork()
        forks.append(time.perf_counter() - start)
        del fork
        start = time.perf_counter()
        environments.reset(seed)
        resets.append(time.perf_counter() - start)
        start = time.perf_counter()
        sim.load(state)
        loads.append(time.perf_counter() - start)
    start = time.perf_counter()
    kept = [sim.fork() for _ in range(8)]
    fresh = (time.perf_counter() - start) / len(kept)
    return {"fork": 1e3 * float(np.median(forks)), "fork_kept": 1e3 * fresh, "reset": 1e3 * float(np.median(resets)), "load": 1e3 * float(np.median(loads))}


def memory(name: str, num_envs: int) -> float:
    """MB of each environment beside the shared model, after some steps."""
    task = Task(name, Options(start_poses=1))
    before = _resident()
    environments = Environments(task, num_envs, os.cpu_count() or 1)
    environments.reset(0)
    for _ in range(2):
        environments.step(np.full((num_envs, task.devices, 2), 10.0))
    return 1e-6 * (_resident() - before) / num_envs


def picture_price(name: str, edge: int, channels: tuple[str, ...]) -> float:
    """ms, median: what an X-ray picture adds to an observation; of an environment that is observed again and again, and not stepped."""
    found = []
    for observation in ("state", "both"):
        task = Task(name, Options(start_poses=1, observation=observation, pixels=(edge, edge), channels=channels))
        environments = Environments(task, 1, 1)
        environments.reset(0)
        environments.step(np.full((1, task.devices, 2), 10.0))
        stay, rounds = np.zeros(1, dtype=bool), []
        for _ in range(60):
            start = time.perf_counter()
            environments.reset(mask=stay)
            rounds.append(time.perf_counter() - start)
        found.append(float(np.median(rounds)))
    return 1e3 * (found[1] - found[0])


def _alone(work: Callable[..., float], *arguments: Any) -> float:
    """In a process of its own, which has no memory to use again."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(work, arguments)


def _say(what: str, value: str, target: str = "") -> None:
    print(f"{what:78} {value:>26}   {target}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m trocar.bench", description="What the Python package costs, measured here.")
    parser.add_argument("--quick", action="store_true", help="a tenth of the time")
    parser.add_argument("--memory-envs", type=int, default=0, help="environments of the memory test; 1000 needs some 20 GB")
    arguments = parser.parse_args()
    seconds = 0.5 if arguments.quick else 6.0
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}\n")
    ways = (("aortic_arch", "left_carotid", "target: 150 of 0.13 s on an idle core"), ("aortic_arch", "", ""), ("u_bend", "end", ""), ("u_bend", "", ""),
            ("hepatic", "", ""))
    for name, way, target in ways:
        found = steps_per_second(name, seconds, way)
        _say(f"{name}, {'a plan to ' + way if way else 'random pushes and turns'}: environment steps of {found['simulated']:.2f} s a second", f"{found['per_second']:.1f}", target)
        _say("    a second of processor time", f"{found['per_cpu_second']:.1f}")
        _say(f"    {found['steps']:.0f} actions: contacts in each step of 10 ms", f"{found['contacts']:.2f}")
        _say("    share of steps with an exact answer; exits; largest force", f"{found['exact']:.3f}; {found['exits']:.0f}; {found['force']:.3f} N")
    one, many, views, empty = batch_overhead(1), batch_overhead(64), batch_overhead(64, False), empty_call()
    _say("binding: of a step of a batch of 1 environment", f"{one:.1f} us", "target: below 20 us")
    _say("    of 64, whose work empties the caches / the same with copy=False", f"{many:.1f} / {views:.1f} us")
    _say("    of any call of C++ that empties the caches, and does nothing else", f"{empty:.1f} us")
    _say("    of 64, over that: the binding's own", f"{many - empty:.1f} / {views - empty:.1f} us", "target: below 20 us")
    by_threads = scaling(seconds)
    for threads, (rate, cpu_rate) in by_threads.items():
        _say(f"aortic_arch, 16 environments, {threads} threads: environment steps a second", f"{rate:.1f} ({rate / by_threads[1][0]:.2f} times one)",
             "target: 1.8 times one" if threads == 2 else "")
        _say("    a second of processor time of all threads", f"{cpu_rate:.1f}")
    for name in ("aortic_arch", "hepatic"):
        costs = reset_and_fork(name)
        _say(f"{name}: a fork where one was given back before / a first one", f"{costs['fork']:.2f} / {costs['fork_kept']:.1f} ms",
             "target: below 1 ms on hepatic" if name == "hepatic" else "")
        _say("    reset of an environment; load of a state", f"{costs['reset']:.2f}; {costs['load']:.2f} ms")
    for name in ("aortic_arch", "hepatic"):
        for edge in (128, 256):
            image, every = picture_price(name, edge, ("image",)), picture_price(name, edge, ("image", "device", "vessel", "depth"))
            _say(f"{name}: an observed X-ray picture of {edge} x {edge}, image alone / with masks and depth", f"{image:.2f} / {every:.2f} ms")
    for name, count in (("aortic_arch", arguments.memory_envs or (8 if arguments.quick else 64)), ("hepatic", 8)):
        _say(f"{name}: memory of each of {count} environments beside the model", f"{_alone(memory, name, count):.1f} MB", "target: below 64 MB")


if __name__ == "__main__":
    main()
