"""Example 4: a policy of 9 numbers, trained by an evolution strategy (CEM; Rubinstein 1999) on some random arches, tried on others.

    python examples/python/4_evolution.py [--quick]

The policy sees what the environment observes, and no centreline: its tip, bend and shaft, the target, and its last action. Beside it stand
example 2's follower without its true position (it has the patient's centreline, knows how the catheter lies at the start, and then takes the tip
to be as far along the way as it has pushed), and random actions.
"""

from __future__ import annotations

import dataclasses
import importlib
import os
import sys
import time
from typing import Any, Callable

import numpy as np
from numpy.typing import NDArray

import trocar
from trocar.anatomy import random_arch

Floats = NDArray[np.float64]
policies: Any = importlib.import_module("2_policies")

SPACING = 8.0  # mm, of the three tracked points: tip, behind its bend, on the shaft
SPEED_FEATURES, TURN_FEATURES = 6, 3
FULL = 35.0 / 7.5  # mm, that the handle moves in an action at full speed
OPTIONS = trocar.Options(spacing=SPACING, start_poses=4, target=3.0, time_limit=20.0)
PATIENCE = 20  # actions without coming nearer, after which an episode of the training is given up
TARGETS = ["left_subclavian", "left_carotid", "brachiocephalic"]
THREADS = os.cpu_count() or 1


class LinearPolicy:
    """Speeds as a linear function of features, each of its own weights. It remembers how fast the tip has moved and come nearer."""

    def __init__(self, weights: Floats) -> None:
        self.weights = weights  # (num_envs, SPEED_FEATURES + TURN_FEATURES)
        self.moved = self.closing = np.ones(len(weights))
        self.away = np.full(len(weights), np.nan)  # mm to the target before

    def __call__(self, observations: NDArray[np.float32], targets: list[str]) -> Floats:
        seen = observations.astype(float)
        tip, behind, shaft, tip_before = (seen[:, 3 * i:3 * i + 3] for i in range(4))
        target, last = seen[:, 18:21], seen[:, 21:23] / [35.0, 3.14]
        along = unit(behind - shaft)
        bend = unit(across(tip - behind, along))
        way = target - tip
        away = np.linalg.norm(way, axis=1)
        side = across(way, along)
        sine, cosine = np.sum(np.cross(bend, side) * along, axis=1), np.sum(bend * side, axis=1)
        begins = ~(np.abs(self.away - away) < 3.0 * FULL)  # an episode
        closing = np.where(begins, FULL, self.away - away) / FULL
        moved = np.where(begins, FULL, np.linalg.norm(tip - tip_before, axis=1)) / FULL
        self.closing, self.moved, self.away = 0.8 * self.closing + 0.2 * closing, 0.8 * self.moved + 0.2 * moved, away
        beside = np.maximum(np.hypot(sine, cosine), 1e-9)
        speed = np.stack([np.ones(len(seen)), np.sum(way * along, axis=1) / away, cosine / beside, self.closing, self.moved, last[:, 0]], axis=1)
        turn = np.stack([sine / beside, last[:, 1], np.maximum(0.0, 1.0 - self.moved)], axis=1)
        raw = np.tanh(np.stack([np.sum(self.weights[:, :SPEED_FEATURES] * speed, axis=1), np.sum(self.weights[:, SPEED_FEATURES:] * turn, axis=1)], axis=1))
        return np.asarray((raw * [25.0, 3.0] + [10.0, 0.0])[:, None, :])


def unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-9))


def across(vectors: Floats, axes: Floats) -> Floats:
    return np.asarray(vectors - axes * np.sum(vectors * axes, axis=1, keepdims=True))


def train(tasks: list[trocar.Task], candidates: int, actions: int, generations: int, seed: int = 0) -> Floats:
    """(SPEED_FEATURES + TURN_FEATURES,): the mean of the last generation. Every candidate goes through the same episodes, side by side."""
    random = np.random.default_rng(seed)
    size = SPEED_FEATURES + TURN_FEATURES
    mean, spread = np.zeros(size), np.full(size, 0.8)
    mean[0] = 0.5  # pushes
    environments = trocar.Environments(tasks, candidates * len(tasks), THREADS, autoreset="disabled")
    kept = candidates // 3
    weights = np.log(kept + 0.5) - np.log(np.arange(1, kept + 1))
    weights /= weights.sum()
    began = time.monotonic()
    for generation in range(generations):
        half = random.normal(size=(candidates // 2, size))
        tried = mean + spread * np.concatenate([half, -half])
        policy = LinearPolicy(np.repeat(tried, len(tasks), axis=0))
        observations, infos = environments.reset([1000 * generation + arch for _ in range(candidates) for arch in range(len(tasks))])
        reward, arrived = np.zeros(environments.num_envs), 0
        nearest, waited = infos["remaining"].copy(), np.zeros(environments.num_envs, dtype=int)
        for _ in range(actions):
            observations, gained, terminated, truncated, infos = environments.step(policy(observations, []))
            reward += gained
            arrived += int(terminated.sum())
            nearer = infos["remaining"] < nearest - 1e-3
            waited = np.where(nearer, 0, waited + 1)
            nearest = np.minimum(nearest, infos["remaining"])
            given_up = ~terminated & (waited >= PATIENCE)
            reward[given_up] -= 1.0
            over = terminated | truncated | given_up
            if over.any():  # the next episode of these, drawn from their sequences
                begun, infos = environments.reset(mask=over)
                observations = np.where(over[:, None], begun, observations)
                nearest, waited = np.where(over, infos["remaining"], nearest), np.where(over, 0, waited)
        score = reward.reshape(candidates, len(tasks)).mean(axis=1)
        best = np.argsort(-score)[:kept]
        mean_before, mean = mean, np.tensordot(weights, tried[best], axes=1)
        found = np.sqrt(np.tensordot(weights, (tried[best] - mean_before) ** 2, axes=1))
        spread = np.maximum(0.1, 0.5 * spread + 0.5 * found)
        took = time.monotonic() - began
        print(f"generation {generation + 1:2}: mean reward {score.mean():6.2f}, best {score.max():6.2f}, {arrived:3} arrivals, {took:4.0f} s", flush=True)
    return mean


class WithoutPosition:
    """Example 2's follower; for the tracked points it is given where the catheter would be if it lay along the way."""

    def __init__(self, task: trocar.Task, num_envs: int) -> None:
        self.follower = policies.Follower(task, num_envs)
        self.tree = task.tree()
        self.start: Floats = np.zeros((0, 0))
        self.ways: list[tuple[Floats, Floats, Floats]] = []
        self.begin: list[float] = []  # mm along the way, of the tip at the start

    def way(self, target: str, bend: Floats) -> tuple[Floats, Floats, Floats]:
        """Arc lengths, points (mm) and the bend of the start, carried along them without torsion."""
        at = int(np.argmin(self.tree["remaining"][target]))
        chain = [at]
        while self.tree["parents"][chain[-1]] >= 0:
            chain.append(int(self.tree["parents"][chain[-1]]))
        points = 1e3 * self.tree["points"][chain[::-1]]
        edges = np.diff(points, axis=0)
        lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(edges, axis=1))])
        tangents = unit(np.concatenate([edges, edges[-1:]]))
        bends = np.empty_like(points)
        carried = bend
        for i in range(len(points)):
            carried = carried - tangents[i] * (carried @ tangents[i])
            carried = carried / max(float(np.linalg.norm(carried)), 1e-9)
            bends[i] = carried
        return lengths, points, bends

    def __call__(self, observations: NDArray[np.float32], targets: list[str]) -> Floats:
        seen = observations.astype(float)
        if not self.ways:
            self.start = seen.copy()
            for row, target in zip(seen, targets):
                tip, behind, shaft = row[:9].reshape(3, 3)
                along = unit((behind - shaft)[None])[0]
                way = self.way(target, tip - behind - along * ((tip - behind) @ along))
                self.ways.append(way)
                self.begin.append(float(way[0][np.linalg.norm(way[1] - tip, axis=1).argmin()]))
        for i, (lengths, points, bends) in enumerate(self.ways):
            length = self.begin[i] + seen[i, 23] - self.start[i, 23]
            turn = seen[i, 24] - self.start[i, 24]
            at = min(max(length, 1.0), float(lengths[-1]))
            behind, ahead = (np.array([np.interp(max(x, 0.0), lengths, points[:, a]) for a in range(3)]) for x in (at - SPACING, at))
            along = unit((ahead - behind)[None])[0]
            behind = ahead - SPACING * along
            shaft = behind - SPACING * along
            bend = bends[min(int(np.searchsorted(lengths, length)), len(bends) - 1)]
            bend = np.cos(turn) * bend + np.sin(turn) * np.cross(along, bend)
            seen[i, :9] = np.concatenate([behind + SPACING * (0.9 * along + 0.4 * bend), behind, shaft])
        return np.asarray(self.follower(seen.astype(np.float32), targets))


if __name__ == "__main__":
    quick = "--quick" in sys.argv
    began = time.monotonic()
    trained_on = [trocar.Task(random_arch(100 + i), dataclasses.replace(OPTIONS, targets=[TARGETS[i % 3]])) for i in range(1 if quick else 6)]
    if quick:
        weights = train(trained_on, candidates=8, actions=6, generations=2)
    else:
        weights = train(trained_on, candidates=14, actions=90, generations=4)
    print(f"weights: {np.round(weights, 2)}")
    made: dict[str, Callable[[trocar.Task, int], Any]] = {
        "trained": lambda task, count: LinearPolicy(np.repeat(weights[None], count, axis=0)),
        "follower without its position": WithoutPosition,
        "random": lambda task, count: policies.random_policy,
    }
    count = 2 if quick else 6
    options = trocar.Options(spacing=SPACING, start_poses=1, time_limit=1.0) if quick else OPTIONS
    held_out = [trocar.Task(random_arch(seed), options) for seed in range(1 if quick else 3)]
    print(f"\n{'policy':30} arrived, of targets drawn on arches it was not trained on")
    for name, make in made.items():
        by_target: dict[str, list[bool]] = {}
        for number, task in enumerate(held_out):
            for target, arrived in policies.success(task, make(task, count), count, seed=number)[0].items():
                by_target.setdefault(target, []).extend(arrived)
        each = ", ".join(f"{target} {sum(a)} of {len(a)}" for target, a in sorted(by_target.items()))
        total = [a for one in by_target.values() for a in one]
        print(f"{name:30} {sum(total)} of {len(total)}: {each}", flush=True)
    print(f"{time.monotonic() - began:.0f} s")
