"""A stand-in for Gymnasium, of our own, for tests on machines without it: the parts of its API that trocar.gym uses, and its rules as checks
(utils/env_checker.py). Where the real one is installed the tests use that."""

from __future__ import annotations

import importlib

import numpy as np

from . import spaces  # noqa: F401
from .utils import seeding

STAND_IN = True
_registry: dict[str, dict] = {}


class Env:
    metadata: dict = {"render_modes": []}
    render_mode = None
    spec = None
    _np_random = None
    _np_random_seed = None

    @property
    def unwrapped(self):
        return self

    @property
    def np_random(self) -> np.random.Generator:
        if self._np_random is None:
            self._np_random, self._np_random_seed = seeding.np_random()
        return self._np_random

    def reset(self, *, seed=None, options=None):
        if seed is not None:
            self._np_random, self._np_random_seed = seeding.np_random(seed)

    def close(self):
        pass


def register(id, entry_point=None, vector_entry_point=None, kwargs=None):
    _registry[id] = {"entry": entry_point, "vector": vector_entry_point, "kwargs": kwargs or {}}


def _find(id, which):
    module, _, name = id.rpartition(":")
    if module:
        importlib.import_module(module)
    entry = _registry[name]
    place, _, attribute = entry[which].partition(":")
    return getattr(importlib.import_module(place), attribute), entry["kwargs"]


def make(id, **kwargs):
    made, defaults = _find(id, "entry")
    return made(**{**defaults, **kwargs})


def make_vec(id, num_envs=1, vectorization_mode=None, vector_kwargs=None, **kwargs):
    assert vectorization_mode == "vector_entry_point"
    made, defaults = _find(id, "vector")
    return made(num_envs=num_envs, **{**defaults, **kwargs})


from . import vector  # noqa: E402,F401
