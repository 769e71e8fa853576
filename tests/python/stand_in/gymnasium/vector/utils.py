import numpy as np

from ..spaces import Box


def batch_space(space, n):
    return Box(np.repeat(space.low[None], n, axis=0), np.repeat(space.high[None], n, axis=0), dtype=space.dtype)
