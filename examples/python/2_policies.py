"""Example 2: two policies that learn nothing, on the arch, with a table of how often they arrive.

    python examples/python/2_policies.py [--quick]

Where the way bends, the follower turns the bent tip to that side; elsewhere it pushes. It sees the catheter's true position.
"""

from __future__ import annotations

import sys
from typing import Callable

import numpy as np
from numpy.typing import NDArray

import trocar

Floats = NDArray[np.float64]
Policy = Callable[[NDArray[np.float32], list[str]], Floats]


class Follower:
    """Pushes where the tip points along the way, turns where it does not, and draws back from where the way is lost."""

    def __init__(self, task: trocar.Task, num_envs: int) -> None:
        tree = task.tree()
        self.points: Floats = 1e3 * tree["points"]
        self.parents = tree["parents"]
        self.remaining: dict[str, Floats] = tree["remaining"]
        self.back = np.zeros(num_envs, dtype=int)  # actions of drawing back that are left
        self.best = np.full(num_envs, np.inf)
        self.stuck = np.zeros(num_envs, dtype=int)
        self.turn = np.zeros(num_envs)  # rad/s while drawing back
        self.random = np.random.default_rng(0)

    def ahead(self, target: str, nearest: int, way: float) -> Floats:
        """mm; the place on the way to the target that is `way` mm nearer to it."""
        remaining = 1e3 * self.remaining[target]
        nearer = np.flatnonzero(remaining <= max(remaining[nearest] - way, remaining.min()))
        return np.asarray(self.points[nearer[np.linalg.norm(self.points[nearer] - self.points[nearest], axis=1).argmin()]])

    def __call__(self, observations: NDArray[np.float32], targets: list[str]) -> Floats:
        actions = np.zeros((len(observations), 1, 2))
        for i, (observation, target) in enumerate(zip(observations.astype(float), targets)):
            tip, behind, farther = observation[:9].reshape(3, 3)
            nearest = int(np.linalg.norm(self.points - tip, axis=1).argmin())
            left = 1e3 * self.remaining[target][nearest]
            self.stuck[i] = 0 if left < self.best[i] - 0.5 else self.stuck[i] + 1
            self.best[i] = min(self.best[i], left)
            if self.stuck[i] > 12:  # the wrong branch, or a fold: back, and turned otherwise
                self.back[i], self.stuck[i], self.best[i] = self.random.integers(6, 16), 0, np.inf
                self.turn[i] = self.random.uniform(-3.0, 3.0)
            if self.back[i] > 0:
                self.back[i] -= 1
                actions[i, 0] = -30.0, self.turn[i]
                continue
            along = (behind - farther) / np.linalg.norm(behind - farther)  # the shaft, behind the bent tip
            bend = tip - behind - along * ((tip - behind) @ along)
            here, near, far = (self.ahead(target, nearest, way) for way in (0.0, 5.0, 20.0))
            straight = (near - here) / max(float(np.linalg.norm(near - here)), 1e-9)
            side = far - here - straight * ((far - here) @ straight)  # to where the way bends
            if np.linalg.norm(side) < 3.0:
                actions[i, 0] = 30.0, 0.0
                continue
            side -= along * (side @ along)
            angle = np.arctan2(np.cross(bend, side) @ along, bend @ side)
            actions[i, 0] = 30.0 if abs(angle) < 0.9 else 0.0, np.clip(6.0 * angle, -3.0, 3.0)
        return actions


def random_policy(observations: NDArray[np.float32], targets: list[str]) -> Floats:
    return RANDOM.uniform([-10.0, -3.14], [35.0, 3.14], (len(observations), 1, 2))


def success(task: trocar.Task, policy: Policy, num_envs: int, seed: int) -> tuple[dict[str, list[bool]], float]:
    """Of one episode in each environment: whether it arrived, by target; the largest force, N."""
    environments = trocar.Environments(task, num_envs, 2, autoreset="disabled")
    observations, infos = environments.reset(seed)
    targets = [environments.episode(i)[1] for i in range(num_envs)]
    arrived = np.zeros(num_envs, dtype=bool)
    over, force = arrived.copy(), 0.0
    while not over.all():
        observations, _, terminated, truncated, infos = environments.step(policy(observations, targets))
        arrived |= terminated & ~over
        force = max(force, float(infos["force"][~over].max()))
        over |= terminated | truncated
    return {name: [bool(a) for a, t in zip(arrived, targets) if t == name] for name in sorted(set(targets))}, force


RANDOM = np.random.default_rng(1)

if __name__ == "__main__":
    quick = "--quick" in sys.argv
    count = 4 if quick else 24
    task = trocar.Task("aortic_arch", trocar.Options(spacing=8.0, time_limit=10.0 if quick else 0.0))
    print(f"{'policy':10} {'target':16} arrived   largest force")
    policies: dict[str, Policy] = {"random": random_policy, "follower": Follower(task, count)}
    for name, policy in policies.items():
        by_target, force = success(task, policy, count, seed=0)
        for target, arrived in by_target.items():
            print(f"{name:10} {target:16} {sum(arrived):3} of {len(arrived):2}  {force:.2f} N")
