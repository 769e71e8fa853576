"""Gymnasium environments: gymnasium.make("trocar.gym:ArchNav-v0"), gymnasium.make_vec(..., vectorization_mode="vector_entry_point").

Actions are (devices, 2) float32: speeds of insertion (mm/s) and rotation (rad/s) within the drives' limits, held for 1/7.5 s.
Observations are (size,) float32 in mm, mm/s and rad: tracked points of each device (memory, devices, points, 3), newest first; target (3);
last action (devices, 2); insertion and rotation (devices, 2), the rotation within -pi and pi. With observation="pixels" they are X-ray pictures,
(rows, columns, channels) uint8, with "both" a dict of "state" and "pixels". render_mode="rgb_array": render() is (rows, columns, 3) uint8.
"""

from __future__ import annotations

import dataclasses
import os
from typing import Any, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

try:
    import gymnasium
    from gymnasium import spaces
    from gymnasium.vector import AutoresetMode
    from gymnasium.vector.utils import batch_space
except ImportError as error:
    raise ImportError("trocar.gym needs Gymnasium 1.1 or later, which is not installed here (pip install gymnasium); everything else of trocar works without it "
                      "(trocar.environments has the same environments)") from error

from ._recording import Recording
from .environments import Environments, Options, SceneLike, Task

#: Identifier and scene of each environment.
IDS = {
    "ArchNav-v0": "aortic_arch", "UBendNav-v0": "u_bend", "HepaticNav-v0": "hepatic", "HepaticHapticNav-v0": "hepatic_haptic",
    "GuidewireNav-v0": "guidewire", "AneurysmNav-v0": "aneurysm", "BifurcationNav-v0": "bifurcation", "SBendNav-v0": "s_bend",
    "StenosisNav-v0": "stenosis", "FlowDirectedNav-v0": "flow_directed",
}

_MODES = {AutoresetMode.NEXT_STEP: "next_step", AutoresetMode.SAME_STEP: "same_step", AutoresetMode.DISABLED: "disabled"}
_SEEDS = 2**63


def _spaces(environments: Environments) -> tuple[Any, Any]:
    limits = environments.limits.astype(np.float32)
    state = spaces.Box(environments.low, environments.high, dtype=np.float32)
    pixels = spaces.Box(0, 255, environments.picture_shape, dtype=np.uint8)
    observed: Any = state
    if environments.observation == "pixels":
        observed = pixels
    elif environments.observation == "both":
        observed = spaces.Dict({"state": state, "pixels": pixels})
    return observed, spaces.Box(-limits, limits, dtype=np.float32)


def _mode_of(autoreset: Any) -> AutoresetMode:
    """AutoresetMode, its value, or the word that trocar.environments takes."""
    for mode, word in _MODES.items():
        if autoreset in (mode, mode.value, word):
            return mode
    raise ValueError(f"autoreset: found {autoreset!r}, expected a gymnasium.vector.AutoresetMode, {', '.join(repr(word) for word in _MODES.values())}")


def _check_render_mode(mode: Optional[str]) -> None:
    if mode not in (None, "rgb_array"):
        raise ValueError(f"render_mode: found {mode!r}, expected None or 'rgb_array'")


def _rgb(environments: Environments, index: int) -> NDArray[np.uint8]:
    image = environments.xray(index).image
    return np.repeat(image[:, :, None], 3, axis=2)


def _options(options: Optional[Options], changes: dict[str, Any]) -> Options:
    known = {field.name for field in dataclasses.fields(Options)}
    for name in changes:
        if name not in known:
            raise TypeError(f"no option {name!r}; known: {', '.join(sorted(known))}")
    return dataclasses.replace(options or Options(), **changes)


class Navigation(gymnasium.Env):  # type: ignore[misc]
    """One environment.

    scene    a scene, its file, a mapping or a shipped scene's name; several of them: every episode draws its anatomy
    options  Options, or any of their fields as keyword arguments
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 7.5}

    def __init__(self, scene: Union[SceneLike, Task, Sequence[Union[SceneLike, Task]]] = "aortic_arch", *, render_mode: Optional[str] = None,
                 options: Optional[Options] = None, **changes: Any) -> None:
        _check_render_mode(render_mode)
        self.render_mode = render_mode
        self.environments = Environments(scene, options=_options(options, changes), autoreset="disabled", draw_scene=True,
                                         renders=render_mode is not None)
        self.observation_space, self.action_space = _spaces(self.environments)
        self._over = True
        self._recording: Optional[Recording] = None

    def record(self, folder: Union[str, "os.PathLike[str]"]) -> None:
        """The next episode, from the next reset to its end or to close(), is written into this folder: `trocar score` simulates it again."""
        if len(self.environments.tasks) > 1:
            raise ValueError("record: found an environment that draws its scene, expected one of one scene")
        self._recording = Recording(folder, self.environments.tasks[0])

    def _write_recording(self) -> None:
        if self._recording is not None and self._recording.seed is not None:
            self._recording.write()
            self._recording = None

    def close(self) -> None:
        self._write_recording()

    def render(self) -> Optional[NDArray[np.uint8]]:
        """(rows, columns, 3) uint8: the X-ray picture as it is now; None without a render_mode."""
        return None if self.render_mode is None else _rgb(self.environments, 0)

    @staticmethod
    def _first(observation: Any) -> Any:
        return {key: value[0] for key, value in observation.items()} if isinstance(observation, dict) else observation[0]

    def reset(self, *, seed: Optional[int] = None, options: Optional[dict[str, Any]] = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self._write_recording()
        drawn = int(self.np_random.integers(_SEEDS))
        observation, infos = self.environments.reset([drawn])
        self._over = False
        if self._recording is not None:
            self._recording.begin(drawn, self.environments._state[0])
        return self._first(observation), self._info(infos)

    def step(self, action: ArrayLike) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        if self._over:
            raise RuntimeError("the episode is over; expected reset() before another step()")
        observation, reward, terminated, truncated, infos = self.environments.step(np.asarray(action)[None])
        self._over = bool(terminated[0] or truncated[0])
        info = self._info(infos)
        if self._recording is not None:
            self._recording.add(np.asarray(action, dtype=np.float64), info["hash"], self.environments._state[0])
            if self._over:
                self._write_recording()
        return self._first(observation), float(reward[0]), bool(terminated[0]), bool(truncated[0]), info

    def _info(self, infos: dict[str, Any]) -> dict[str, Any]:
        info: dict[str, Any] = {key: infos[key][0].item() for key in Environments._KEYS if key not in ("hash", "task", "target")}
        info["hash"] = f"{int(infos['hash'][0]):016x}"
        info["scene"], info["target"] = self.environments.episode(0)
        info["success"] = bool(infos["success"][0])
        info["reward_terms"] = dict(zip(("progress", "target", "force", "step"), infos["reward_terms"][0].tolist()))
        info["failure"] = infos["failure"][0] if "failure" in infos else ""
        if "tip_pixels" in infos:
            info["tip_pixels"] = infos["tip_pixels"][0]
        return info


class VectorEnv(gymnasium.vector.VectorEnv):  # type: ignore[misc]
    """num_envs environments on a pool of num_threads threads in this process.

    scene        as Navigation's; of several, environment i is of scene i modulo their number, or with draw_scene every episode draws one
    autoreset    AutoresetMode.NEXT_STEP, SAME_STEP (infos["final_obs"]) or DISABLED (reset(options={"reset_mask": mask}))
    copy         False: returned arrays are read-only views that the next step overwrites
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 7.5, "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(self, scene: Union[SceneLike, Task, Sequence[Union[SceneLike, Task]]] = "aortic_arch", num_envs: int = 1, num_threads: int = 1, *,
                 autoreset: Any = AutoresetMode.NEXT_STEP, draw_scene: bool = False, copy: bool = True, render_mode: Optional[str] = None,
                 options: Optional[Options] = None, **changes: Any) -> None:
        _check_render_mode(render_mode)
        mode = _mode_of(autoreset)
        self.metadata = {**self.metadata, "autoreset_mode": mode}
        self.num_envs = num_envs
        self.render_mode = render_mode
        self.environments = Environments(scene, num_envs, num_threads, options=_options(options, changes), autoreset=_MODES[mode],
                                         draw_scene=draw_scene, copy=copy, renders=render_mode is not None)
        self.single_observation_space, self.single_action_space = _spaces(self.environments)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(self, *, seed: Union[None, int, Sequence[Optional[int]]] = None, options: Optional[dict[str, Any]] = None
              ) -> tuple[Any, dict[str, Any]]:
        """seed: an int (environment i draws from seed + i) or one for each; options["reset_mask"]: (num_envs,) bool, which."""
        mask = (options or {}).get("reset_mask")
        seeds: list[Optional[int]]
        if seed is None:
            seeds = [None] * self.num_envs
        elif isinstance(seed, (int, np.integer)):
            seeds = [int(seed) + i for i in range(self.num_envs)]
        else:
            seeds = list(seed)
        super().reset(seed=seeds[0])
        if seed is None and mask is None:  # drawn anew, as nobody says where to begin
            seeds = [int(drawn) for drawn in self.np_random.integers(_SEEDS, size=self.num_envs)]
        return self.environments.reset(seeds, mask)

    def render(self) -> Optional[tuple[NDArray[np.uint8], ...]]:
        """An X-ray picture of each environment, (rows, columns, 3) uint8; None without a render_mode."""
        return None if self.render_mode is None else tuple(_rgb(self.environments, i) for i in range(self.num_envs))

    def step(self, actions: ArrayLike) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        return self.environments.step(actions)


for _id, _scene in IDS.items():
    gymnasium.register(_id, entry_point="trocar.gym:Navigation", vector_entry_point="trocar.gym:VectorEnv", kwargs={"scene": _scene})
gymnasium.register("SceneNav-v0", entry_point="trocar.gym:Navigation", vector_entry_point="trocar.gym:VectorEnv")
