"""Scenes made from a seed, as mappings that trocar.load takes."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np

from ._functions import scene_path


def shipped(name: str) -> dict[str, Any]:
    """A scene that comes with the package, as a mapping to change and load."""
    with open(scene_path(name), encoding="utf-8") as file:
        scene: dict[str, Any] = json.loads(re.sub(r"^\s*//.*$|\s//\s.*$", "", file.read(), flags=re.MULTILINE))
    del scene["$schema"]
    return scene


def random_arch(seed: int) -> dict[str, Any]:
    """An aortic arch like the shipped one: as a whole wider or narrower, its height stretched, each branch shifted along the arch,
    bent and of another width, by what patients differ; the same of the same seed."""
    random = np.random.default_rng(seed)
    scene = shipped("aortic_arch")
    scene["name"] = f"arch-{seed}"
    surface = scene["bodies"]["vessel"]["surface"]
    spread = np.array([random.uniform(0.9, 1.1), random.uniform(0.9, 1.1), random.uniform(0.95, 1.05)])
    arch, *branches = [np.array(branch, dtype=float) for branch in surface["branches"]]
    for row in (arch, *branches):
        row[:, :3] *= spread
    ends = {}
    names = ("left_subclavian", "left_carotid", "brachiocephalic")
    for name, branch in zip(names, branches):
        length = np.linalg.norm(branch[:, :3] - branch[0, :3], axis=1) / np.linalg.norm(branch[-1, :3] - branch[0, :3])
        branch[1:, :2] += random.uniform(-6.0, 6.0, 2) * length[1:, None] + random.uniform(-4.0, 4.0, 2) * np.sin(np.pi * length[1:, None])
        branch[:, 3] *= random.uniform(0.92, 1.08)
        ends[name] = 0.25 * branch[-2, :3] + 0.75 * branch[-1, :3]
    surface["branches"] = [branch.round(4).tolist() for branch in (arch, *branches)]
    scene["targets"] = {name: {"position": end.round(4).tolist()} for name, end in ends.items()}
    entry = scene["instruments"]["catheter"]["entry"]["position"]
    entry[:] = (np.array(entry) * spread).round(4).tolist()
    return scene
