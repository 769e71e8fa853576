"""Episodes written down, for `trocar score` to simulate again."""

from __future__ import annotations

import json
import os
import pathlib
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _engine
from ._build import build_id
from .environments import Task


class Recording:
    """One episode of one environment: begun by a reset with a known seed, written when it ends.

    The folder holds manifest.json (scene, options, seed, budget, hashes of the program, the model and the files), manifest.hash,
    actions.csv (a row for each action: mm/s and rad/s of each device, and the hash of the state after it) and observations.npy.
    """

    def __init__(self, folder: Union[str, "os.PathLike[str]"], task: Task) -> None:
        self.folder = pathlib.Path(folder)
        if self.folder.exists() and (not self.folder.is_dir() or any(self.folder.iterdir())):
            raise FileExistsError(f"{self.folder} is not empty; expected a new or an empty folder")
        if task.budget != "exact" and not task.budget.startswith("work:"):
            raise ValueError(f"budget: found {task.budget}, which depends on a clock; expected exact or work:TESTS for an episode that can be simulated again")
        self.task = task
        self.seed: Optional[int] = None
        self.actions: list[NDArray[np.float64]] = []
        self.hashes: list[str] = []
        self.observations: list[NDArray[np.float32]] = []

    def begin(self, seed: int, observation: NDArray[np.float32]) -> None:
        self.seed, self.actions, self.hashes, self.observations = seed, [], [], [observation.copy()]

    def add(self, action: NDArray[np.float64], state: str, observation: NDArray[np.float32]) -> None:
        self.actions.append(np.array(action, dtype=np.float64).ravel())
        self.hashes.append(state)
        self.observations.append(observation.copy())

    def write(self) -> None:
        """Complete, the manifest last."""
        self.folder.mkdir(parents=True, exist_ok=True)
        columns = [f"{name}.{what}" for name in self.task.scene.instruments for what in ("insertion_mm_s", "rotation_rad_s")]
        rows = [",".join(columns + ["state"])]
        rows += [",".join([repr(float(x)) for x in action] + [state]) for action, state in zip(self.actions, self.hashes)]
        (self.folder / "actions.csv").write_text("\n".join(rows) + "\n", encoding="ascii")
        np.save(self.folder / "observations.npy", np.array(self.observations))
        files = {name: _engine.hash_bytes((self.folder / name).read_bytes()) for name in ("actions.csv", "observations.npy")}
        file, text, _, anatomy_seed = self.task.scene._source()
        options: dict[str, Any] = self.task.options._engine_options()
        del options["budget"]
        manifest = {"kind": "trocar-episode", "version": 1, "program": build_id(), "model": self.task.scene.hash,
                    "scene": {"name": self.task.scene.name, "file": file, "text": text, "anatomy_seed": anatomy_seed},
                    "seed": str(self.seed), "budget": self.task.budget, "options": options, "files": files}
        data = (json.dumps(manifest, indent=2) + "\n").encode()
        (self.folder / "manifest.json").write_bytes(data)
        (self.folder / "manifest.hash").write_text(_engine.hash_bytes(data) + "\n", encoding="ascii")
