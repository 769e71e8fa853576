"""Episodes written down, for `trocar score` to simulate again."""

from __future__ import annotations

import csv
import os
import pathlib
from typing import Optional, Union

import numpy as np
from numpy.typing import NDArray

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
        with open(self.folder / "actions.csv", "w", newline="", encoding="utf-8") as file:
            rows = csv.writer(file, lineterminator="\n")
            rows.writerow([*columns, "state"])
            rows.writerows([*action.tolist(), state] for action, state in zip(self.actions, self.hashes))
        np.save(self.folder / "observations.npy", np.array(self.observations))
        assert self.seed is not None
        self.task._task.write_manifest(str(self.folder), self.seed, ["actions.csv", "observations.npy"])
