from __future__ import annotations

import numpy as np

from .utils import seeding


class Box:
    def __init__(self, low, high, shape=None, dtype=np.float32):
        self.dtype = np.dtype(dtype)
        self.low, self.high = np.array(low, dtype=self.dtype), np.array(high, dtype=self.dtype)
        if shape is not None:
            self.low, self.high = np.full(shape, self.low), np.full(shape, self.high)
        assert self.low.shape == self.high.shape and (self.low <= self.high).all()
        self.shape = self.low.shape
        self._random, _ = seeding.np_random(0)

    def seed(self, seed):
        self._random, _ = seeding.np_random(seed)

    def sample(self):
        return self._random.uniform(self.low, self.high).astype(self.dtype)

    def contains(self, x):
        return isinstance(x, np.ndarray) and x.dtype == self.dtype and x.shape == self.shape and bool((x >= self.low).all() and (x <= self.high).all())

    __contains__ = contains


class Dict:
    def __init__(self, spaces):
        self.spaces = dict(spaces)

    def __getitem__(self, key):
        return self.spaces[key]

    def contains(self, x):
        return isinstance(x, dict) and x.keys() == self.spaces.keys() and all(x[key] in space for key, space in self.spaces.items())

    __contains__ = contains
