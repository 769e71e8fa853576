"""Navigation environments, without Gymnasium: bring an instrument's tip to a target of its vessel. trocar.gym puts Gymnasium's API on them.

Units are the field's: mm, mm/s, rad/s, N. One action is (devices, 2): speeds of insertion and of rotation, held for Options.hold.
"""

from __future__ import annotations

import dataclasses
import functools
import os
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _engine
from ._functions import load, scene_path, scenes
from .pictures import XrayFrame, camera_of

#: observations, rewards, terminated, truncated, infos
Answer = Tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Dict[str, Any]]
SceneLike = Union[_engine.Scene, str, "os.PathLike[str]", Mapping[str, Any]]

REWARD_TERMS = ("progress", "target", "force", "step")


@dataclasses.dataclass(frozen=True)
class Options:
    """What the environments of a task share."""

    hold: float = 1.0 / 7.5  #: s, that an action is held: the nearest whole number of steps
    points: int = 3  #: tracked on each device, from its tip backwards
    spacing: float = 2.0  #: mm, of the tracked points along the device
    memory: int = 2  #: actions after which tracked points are observed, the newest included
    targets: Sequence[str] = ()  #: names that episodes draw from; empty: all that can be reached
    tolerance: float = 5.0  #: mm, tip to target: reached
    time_limit: float = 0.0  #: s of an episode; 0: three times what the longest way takes at full speed, at least 10 s
    progress: float = 10.0  #: reward for each metre that the way along the centreline becomes shorter
    target: float = 1.0  #: reward for reaching it
    force: float = 0.0  #: reward for each newton of the largest force at one place on a wall: below 0
    step: float = -0.005  #: reward for each action
    start_poses: int = 8  #: turns of the handle and insertions that episodes start from
    start_spread: float = 10.0  #: mm, of these insertions
    observation: str = "state"  #: "state", "pixels" (X-ray pictures) or "both", a dict of the two
    view: Optional[str] = None  #: of the scene's outputs.fluoroscopy that pictures are of; None: its first, or the whole patient from the front
    pixels: tuple[int, int] = (128, 128)  #: columns and rows of a picture, on the view's detector
    channels: Sequence[str] = ("image",)  #: of "image", "device", "vessel", "depth": the last axis of a picture
    budget: Optional[str] = "exact"  #: of every step; None: the scene's, which may depend on a clock

    def _engine_options(self) -> dict[str, Any]:
        if self.points < 0 or self.memory < 0 or self.start_poses < 0:
            raise ValueError(f"points, memory, start_poses: found {self.points}, {self.memory}, {self.start_poses}, expected 1 or more")
        return {"hold": float(self.hold), "points": self.points, "spacing": 1e-3 * self.spacing, "memory": self.memory, "targets": list(self.targets),
                "tolerance": 1e-3 * self.tolerance, "time_limit": float(self.time_limit),
                "reward": [float(self.progress), float(self.target), float(self.force), float(self.step)],
                "start_poses": self.start_poses, "start_spread": 1e-3 * self.start_spread, "budget": self.budget}


@functools.lru_cache(maxsize=8)
def _load_file(file: str, changed: int) -> _engine.Scene:
    return load(file)


def as_scene(scene: SceneLike) -> _engine.Scene:
    """A scene itself, of a file, a mapping, or of the name of one that comes with the package. Files are loaded once."""
    if isinstance(scene, _engine.Scene):
        return scene
    if isinstance(scene, Mapping):
        return load(scene)
    file = os.path.abspath(scene_path(scene) if isinstance(scene, str) and scene in scenes() else scene)
    return _load_file(file, os.stat(file).st_mtime_ns if os.path.exists(file) else 0)


class Task:
    """Navigation in one scene: centreline, targets and start poses, found once and shared by any number of environments."""

    def __init__(self, scene: SceneLike, options: Options = Options()) -> None:
        self.scene = as_scene(scene)
        self.options = options
        self._task = _engine.Task(self.scene, options._engine_options())
        told = self._task.describe()
        self.low: NDArray[np.float32] = told["low"]  #: (observation_size,)
        self.high: NDArray[np.float32] = told["high"]  #: (observation_size,)
        self.devices: int = told["devices"]
        self.targets: list[str] = told["targets"]
        self.limits: NDArray[np.float64] = np.array(told["limits"]) * [1e3, 1.0]  #: (devices, 2) mm/s, rad/s
        self.steps_per_action: int = told["steps_per_action"]
        self.action_limit: int = told["action_limit"]  #: actions of an episode
        self.budget: str = told["budget"]

    @property
    def observation_size(self) -> int:
        """Tracked points (memory, devices, points, 3), target (3), last action (devices, 2), insertion and rotation (devices, 2)."""
        return len(self.low)

    def tree(self) -> dict[str, Any]:
        """The vessel's centreline: points (N, 3) m, radii (N,) m, parents (N,) (-1: root), remaining: m to each target by name."""
        tree: dict[str, Any] = self._task.tree()
        return tree


def _tasks(scenes: Union[SceneLike, Task, Sequence[Union[SceneLike, Task]]], options: Options) -> list[Task]:
    several: list[Any] = list(scenes) if isinstance(scenes, (list, tuple)) else [scenes]
    if not several:
        raise ValueError("scenes: found none, expected one or more")
    tasks = [scene if isinstance(scene, Task) else Task(scene, options) for scene in several]
    sizes = {(task.devices, task.observation_size) for task in tasks}
    if len(sizes) > 1:
        raise ValueError(f"scenes: found environments of (devices, observation size) {sorted(sizes)}, expected the same of all")
    return tasks


class Environments:
    """num_envs environments on num_threads threads: what each of them does follows from its seed and its actions alone.

    scenes         one scene or task, or several: environment i is of scene i modulo their number
    draw_scene     instead, every episode draws its scene (its anatomy) from all of them
    autoreset      "next_step": the action after an episode's end begins another, and is not taken; "same_step": another begins at once,
                   infos["final_obs"] holds the last observation; "disabled": reset() with a mask
    copy           False: returned arrays are read-only views that the next step overwrites. True: an array that is kept, by itself or by a view of it,
                   stays as it is; those that nobody keeps are used again, so a weak reference to one does not end with it
    renders        xray() has a camera, though observations have no pixels

    Observations are (num_envs, size) float32; with Options.observation "pixels" (num_envs, rows, columns, channels) uint8; with "both" a dict of
    "state" and "pixels". With pixels infos hold "tip_pixels" (num_envs, devices, 2).
    """

    _MODES = {"next_step": 0, "same_step": 1, "disabled": 2}

    def __init__(self, scenes: Union[SceneLike, Task, Sequence[Union[SceneLike, Task]]], num_envs: int = 1, num_threads: int = 1, *,
                 options: Options = Options(), autoreset: str = "next_step", draw_scene: bool = False, copy: bool = True,
                 renders: bool = False) -> None:
        if not 1 <= num_envs <= 1_000_000:
            raise ValueError(f"num_envs: found {num_envs}, expected 1 to 1000000")
        if not 1 <= num_threads <= 1024:
            raise ValueError(f"num_threads: found {num_threads}, expected 1 to 1024")
        if autoreset not in self._MODES:
            raise ValueError(f"autoreset: found {autoreset!r}, expected one of {', '.join(self._MODES)}")
        self.tasks = _tasks(scenes, options)
        self.num_envs, self.num_threads, self.autoreset, self.copy = num_envs, num_threads, autoreset, copy
        each = [[task._task for task in self.tasks] if draw_scene else [self.tasks[i % len(self.tasks)]._task] for i in range(num_envs)]
        shared = self.tasks[0].options
        if any(task.options.observation != shared.observation for task in self.tasks):
            raise ValueError("scenes: found tasks of several kinds of observation, expected the same of all")
        camera = camera_of(shared.observation, shared.view, shared.pixels, shared.channels, renders)
        self.observation = shared.observation
        self.picture_shape = (0, 0, 0) if camera is None else (camera["pixels"][1], camera["pixels"][0], len(camera["channels"]))  #: rows, columns, channels
        self._batch = _engine.Batch(each, num_threads, self._MODES[autoreset], copy, camera)
        self._step = self._batch.step
        self.devices = self.tasks[0].devices
        self.low = np.min([task.low for task in self.tasks], axis=0)
        self.high = np.max([task.high for task in self.tasks], axis=0)
        self.limits = np.max([task.limits for task in self.tasks], axis=0)  #: (devices, 2) mm/s, rad/s

    def reset(self, seeds: Union[None, int, Sequence[Optional[int]]] = None, mask: Optional[ArrayLike] = None
              ) -> tuple[Any, dict[str, Any]]:
        """Begins episodes: everything in them follows from the seeds.

        seeds    an int: environment i takes seed + i; a sequence with None where an environment goes on with what it drew last
        mask     (num_envs,) bool: which; None: all
        returns  observations (num_envs, size) float32 in mm, mm/s, rad; infos
        """
        taken: list[Optional[int]] = []
        if isinstance(seeds, (int, np.integer)):
            taken = [int(seeds) + i for i in range(self.num_envs)]
        elif seeds is not None:
            taken = [None if seed is None else int(seed) for seed in seeds]
        if taken and len(taken) != self.num_envs:
            raise ValueError(f"seeds: found {len(taken)}, expected {self.num_envs}")
        for seed in taken:
            if seed is not None and not 0 <= seed < 2**64:
                raise ValueError(f"seed: found {seed}, expected 0 to {2**64 - 1}")
        which: list[int] = []
        if mask is not None:
            chosen = np.asarray(mask)
            if chosen.dtype != np.bool_ or chosen.shape != (self.num_envs,):
                raise ValueError(f"mask: found {chosen.dtype} {chosen.shape}, expected bool ({self.num_envs},)")
            which = chosen.astype(int).tolist()
        observations, infos = self._batch.reset(taken, which)
        return self._observed(observations, infos), infos

    def step(self, actions: ArrayLike) -> Answer:
        """One action of every environment: (num_envs, devices, 2) mm/s and rad/s, taken within the drives' limits."""
        answer: Union[Answer, list[Any], None] = self._step(actions)
        return answer if isinstance(answer, tuple) else self._finish(answer, actions)

    def _finish(self, answer: Optional[list[Any]], actions: ArrayLike) -> Answer:
        """What a step leaves to Python: actions that are no contiguous array of float64, and answers that something is to be added to."""
        state, reward, terminated, truncated, infos = answer or self._step(self._checked(actions))
        if self._batch.has_more_to_tell:
            self._add_rare(infos)
        return self._observed(state, infos), reward, terminated, truncated, infos

    @property
    def _state(self) -> NDArray[np.float32]:
        """The last observation's numbers, whatever is observed."""
        state: NDArray[np.float32] = self._batch.observation
        return state

    def _observed(self, state: NDArray[np.float32], infos: dict[str, Any]) -> Any:
        """What the options observe, of the last answer."""
        if self.observation == "state":
            return state
        infos["tip_pixels"] = self._batch.tips
        infos["_tip_pixels"] = infos["_success"]
        pixels = self._batch.pixels
        return pixels if self.observation == "pixels" else {"state": state, "pixels": pixels}

    def _checked(self, actions: ArrayLike) -> NDArray[np.float64]:
        given = np.asarray(actions)
        if given.dtype.kind not in "fiu":
            raise TypeError(f"actions: found dtype {given.dtype}, expected real numbers, ({self.num_envs}, {self.devices}, 2)")
        if given.shape != (self.num_envs, self.devices, 2):
            raise ValueError(f"actions: found shape {given.shape}, expected ({self.num_envs}, {self.devices}, 2)")
        return np.ascontiguousarray(given, dtype=np.float64)

    _KEYS = ("remaining", "distance", "force", "exits", "unresolved", "assumed", "overruns", "exact_steps", "contacts", "hash", "task", "target",
             "start")

    def _add_rare(self, infos: dict[str, Any]) -> None:
        """Failures, and the ends of episodes that others have followed already."""
        outcome = self._batch.outcome
        failed = outcome["failed"].astype(bool)
        if failed.any():
            infos["failure"] = np.array([self._batch.failure(i) if failed[i] else None for i in range(self.num_envs)], dtype=object)
            infos["_failure"] = failed
        ended = outcome["began"].astype(bool) & (outcome["action"] > 0)
        if self.autoreset == "same_step" and ended.any():
            last, final = self._batch.final_observation, np.full(self.num_envs, None, dtype=object)
            pixels = self._batch.final_pixels
            for i in np.flatnonzero(ended):
                if self.observation == "state":
                    final[i] = last[i].copy()
                elif self.observation == "pixels":
                    final[i] = pixels[i].copy()
                else:
                    final[i] = {"state": last[i].copy(), "pixels": pixels[i].copy()}
            infos["final_obs"], infos["_final_obs"] = final, ended
            infos["final_info"], infos["_final_info"] = {key: infos[key] for key in self._KEYS}, ended

    def save(self, index: int = 0) -> _engine.SavedState:
        """The state of an environment, for a simulator of its scene or for trocar.rollout."""
        return self._batch.save(index)

    def rods(self, index: int = 0) -> list[NDArray[np.float64]]:
        """(N, 3) m, of each device of an environment, the tip last."""
        rods: list[NDArray[np.float64]] = self._batch.rods(index)
        return rods

    def xray(self, index: int = 0) -> XrayFrame:
        """All that an environment's X-ray picture says now: masks, depth, tips and centrelines in pixels, whatever is observed."""
        return XrayFrame(**self._batch.xray(index))

    def episode(self, index: int = 0) -> tuple[str, str]:
        """Names of the scene and the target of an environment's episode."""
        return self._batch.episode(index)


@dataclasses.dataclass(frozen=True)
class RolloutResult:
    """Answers of trocar.rollout, for B rollouts of T actions with D devices."""

    tip: NDArray[np.float64]  #: (B, T, D, 3) m, after each action
    insertion: NDArray[np.float64]  #: (B, T, D) m
    rotation: NDArray[np.float64]  #: (B, T, D) rad
    force: NDArray[np.float64]  #: (B, T) N, largest at one place on a wall during the action
    exits: NDArray[np.uint32]  #: (B, T) instrument vertices outside the lumen, summed over the action's steps
    hash: NDArray[np.uint64]  #: (B,) of the state at the end
    done: NDArray[np.uint64]  #: (B,) actions before a failure: T where there was none
    states: list[_engine.SavedState]  #: B states at the end, where they were asked for


class Rollout:
    """Sequences of actions from many states on a pool of threads, kept from call to call: see trocar.rollout."""

    def __init__(self, scene: SceneLike, num_threads: int = 1) -> None:
        if not 1 <= num_threads <= 1024:
            raise ValueError(f"num_threads: found {num_threads}, expected 1 to 1024")
        self.scene = as_scene(scene)
        self._rollout = _engine.Rollout(self.scene, num_threads)

    def __call__(self, states: Union[_engine.SavedState, Sequence[_engine.SavedState]], actions: ArrayLike, *, hold: float = 1.0 / 7.5,
                 keep_states: bool = False) -> RolloutResult:
        """states: one for all, or B; actions: (B, T, D, 2) mm/s and rad/s; hold: s, that each is held."""
        devices = len(self.scene.instruments)
        given = np.asarray(actions)
        if given.dtype.kind not in "fiu":
            raise TypeError(f"actions: found dtype {given.dtype}, expected real numbers, (B, T, {devices}, 2)")
        if given.ndim != 4 or given.shape[2:] != (devices, 2):
            raise ValueError(f"actions: found shape {given.shape}, expected (B, T, {devices}, 2)")
        each = [states] * len(given) if isinstance(states, _engine.SavedState) else list(states)
        if len(each) != len(given):
            raise ValueError(f"states: found {len(each)}, expected one, or {len(given)} as there are action sequences")
        if not self.scene.step <= hold <= 60.0:
            raise ValueError(f"hold: found {hold}, expected {self.scene.step} s (a step) to 60 s")
        si = np.ascontiguousarray(given * np.array([1e-3, 1.0]))
        return RolloutResult(**self._rollout.run(each, si, max(1, round(hold / self.scene.step)), keep_states))


def rollout(scene: SceneLike, states: Union[_engine.SavedState, Sequence[_engine.SavedState]], actions: ArrayLike, *, num_threads: int = 1,
            hold: float = 1.0 / 7.5, keep_states: bool = False) -> RolloutResult:
    """Each sequence of actions from its state, side by side on num_threads threads; the states themselves stay as they are.

    states   one SavedState for all, or B of them        actions   (B, T, devices, 2) mm/s and rad/s, each held for `hold` s
    """
    return Rollout(scene, num_threads)(states, actions, hold=hold, keep_states=keep_states)
