import numpy as np

from ..spaces import Box, Dict


def batch_space(space, n):
    if isinstance(space, Dict):
        return Dict({key: batch_space(part, n) for key, part in space.spaces.items()})
    return Box(np.repeat(space.low[None], n, axis=0), np.repeat(space.high[None], n, axis=0), dtype=space.dtype)
