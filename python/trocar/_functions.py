"""What the command line does, as functions."""

from __future__ import annotations

import dataclasses
import json
import os
import pathlib
from typing import Any, Mapping, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _engine


def scenes() -> list[str]:
    """Names of the scenes that come with the package."""
    return sorted(file.stem for file in (_assets() / "scenes").glob("*.json"))


def scene_path(name: str) -> str:
    """File of a scene that comes with the package."""
    file = _assets() / "scenes" / (name + ".json")
    if not file.is_file():
        raise FileNotFoundError(f"no scene {name!r} comes with trocar; known: {', '.join(scenes())}")
    return str(file)


def _assets() -> pathlib.Path:
    return pathlib.Path(__file__).parent / "assets"


def load(scene: Union[str, "os.PathLike[str]", Mapping[str, Any]], *, budget: Optional[str] = None, anatomy_seed: Optional[int] = None,
         base: Union[str, "os.PathLike[str]", None] = None) -> _engine.Scene:
    """Reads and prepares a scene: once, immutable, for any number of simulators.

    scene         file, or the same as a mapping
    budget        of every step, in place of the scene's: "8ms" (wall time), "work:20000" (sphere-pair tests), "exact"
    anatomy_seed  of the recipes from which its bodies are generated, in place of their own
    base          of a mapping: the folder that its names of files are relative to (the working folder)
    raises        trocar.Error with file, line, key and what was expected
    """
    text = ""
    if isinstance(scene, Mapping):
        text = json.dumps(scene)
        file = pathlib.Path(base if base is not None else os.getcwd()) / "scene.json"
    else:
        file = pathlib.Path(scene)
    if anatomy_seed is not None and not 0 <= anatomy_seed < 2**32:
        raise ValueError(f"anatomy_seed: found {anatomy_seed}, expected 0 to {2**32 - 1}")
    return _engine.load_scene(os.path.abspath(file), text, budget or "", anatomy_seed)


@dataclasses.dataclass(frozen=True)
class Plan:
    """The way to a target, and the drive commands that take the first instrument there."""

    arrived: bool
    time: float  #: s, when the tip arrived, or the trial's end
    path: NDArray[np.float64]  #: (steps, 3) time s, insertion m, rotation rad
    centreline: NDArray[np.float64]  #: (N, 4) x, y, z, radius in m, at rest; the last row is the target
    length: float  #: m, of the way
    closest: float  #: m, tip to target at its nearest
    last: float  #: m, tip to target at the end
    replayed_last: float  #: m, the same when the path is replayed in the scene as it is; 0 where it did not arrive
    retractions: int
    exits: int  #: instrument vertices outside the lumen, summed over the steps
    largest_force: float  #: N, on a wall


def plan(scene: _engine.Scene, target: str, *, time: float = 0.0) -> Plan:
    """Finds the way to a target of the scene, and a motion that goes there, by simulation: `trocar plan`.

    time    s of simulated time that the trial may take; 0: from the length of the way
    raises  trocar.Error where there is no way
    """
    if not 0.0 <= time <= 1e5:
        raise ValueError(f"time: found {time}, expected 0 to 1e5 s")
    return Plan(**_engine.plan(scene, target, time))


def contacts(V0: ArrayLike, V1: ArrayLike, F: ArrayLike, other: Optional[tuple[ArrayLike, ArrayLike, ArrayLike]] = None, *,
             within: bool = True, distance: float = 0.0, threads: int = 1) -> NDArray[Any]:
    """Exact contacts while vertices move linearly from V0 to V1: `trocar contacts`.

    V0, V1    (N, 3) start and end positions, any unit        F   (M, 3) ids of the triangles' vertices
    other     V0, V1, F of a second surface; then contacts between the two are found as well
    within    each surface against itself
    distance  no farther apart than this counts as contact; up to 1e-9 of it more may be reported
    returns   structured array, sorted: kind (b"VF", b"EE"), body_a, body_b, feature_a (2) and feature_b (3) vertex ids (-1: none),
              time in [0, 1], bary_a and bary_b (2) weights, normal (3) from b to a
    """
    surfaces = []
    for name, (a, b, f) in zip(("", "other: "), [(V0, V1, F)] + ([other] if other is not None else [])):
        start = _arrays.points(name + "V0", a)
        surfaces.append((start, _arrays.points(name + "V1", b, len(start)), _arrays.triangles(name + "F", f, len(start))))
    if not 0.0 <= distance <= 1e100:
        raise ValueError(f"distance: found {distance}, expected a number from 0 up")
    if not 1 <= threads <= 256:
        raise ValueError(f"threads: found {threads}, expected 1 to 256")
    return _engine.contacts(surfaces, within, float(distance), int(threads))


def centreline(scene: _engine.Scene, target: str, instrument: int = 0) -> NDArray[np.float64]:
    """(N, 4) x, y, z, radius in m: the middle of the lumen from an instrument's entry to a target, at rest."""
    return _engine.centreline(scene, target, instrument)
