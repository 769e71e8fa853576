"""Example 3: model-predictive planning by forks (MPPI; Williams et al. 2017) steers into a branch without any training.

    python examples/python/3_planning.py [--quick]

In each round many sequences of actions are simulated from the present state, on all cores; the first two of their mean, weighted by how
far each came, are taken in the true scene.
"""

from __future__ import annotations

import os
import sys

import numpy as np
from numpy.typing import NDArray

import trocar

Floats = NDArray[np.float64]


def plan(target: str, samples: int, horizon: int, rounds: int, seed: int = 0) -> tuple[float, int]:
    """Distance to the target at the end, m, and the rounds that were taken."""
    task = trocar.Task("aortic_arch", trocar.Options(targets=[target], start_poses=1))
    tree = task.tree()
    points, remaining = tree["points"], tree["remaining"][target]
    rollout = trocar.Rollout(task.scene, os.cpu_count() or 1)
    random = np.random.default_rng(seed)
    environment = trocar.Environments(task)
    environment.reset(0)
    mean: Floats = np.tile([25.0, 0.0], (horizon, 1))
    spread = np.array([12.0, 2.5])
    distance = np.inf
    for number in range(rounds):
        # turns last: one draw for each half of the horizon, and a little for each action
        halves = np.repeat(random.normal(size=(samples, 2, 2)), (horizon + 1) // 2, axis=1)[:, :horizon]
        noise = (0.8 * halves + 0.4 * random.normal(size=(samples, horizon, 2))) * spread
        noise[0] = 0.0
        actions = np.clip(mean + noise, [-30.0, -3.14], [35.0, 3.14])
        found = rollout(environment.save(0), actions[:, :, None, :])
        tips = found.tip[:, -1, 0]
        left = remaining[np.linalg.norm(points[None] - tips[:, None], axis=2).argmin(axis=1)]
        cost = 1e3 * left + 20.0 * found.force.max(axis=1) + 100.0 * found.exits.sum(axis=1)  # mm
        weight = np.exp(-(cost - cost.min()) / 4.0)
        mean = (weight[:, None, None] * actions).sum(axis=0) / weight.sum()
        for action in mean[:2]:
            _, _, terminated, truncated, infos = environment.step(action[None, None])
            distance = float(infos["distance"][0])
            if terminated[0] or truncated[0]:
                return distance, number + 1
        if number % 5 == 0:
            print(f"round {number:3}: {1e3 * infos['remaining'][0]:6.1f} mm to go, largest force {infos['force'][0]:.3f} N, exits {infos['exits'][0]}")
        mean = np.vstack([mean[2:], np.tile([25.0, 0.5 * mean[-1, 1]], (2, 1))])
    return distance, rounds


if __name__ == "__main__":
    quick = "--quick" in sys.argv
    distance, rounds = plan("left_subclavian", samples=8 if quick else 24, horizon=6 if quick else 10, rounds=3 if quick else 150)
    print(f"{1e3 * distance:.1f} mm from the target after {rounds} rounds")
