"""Checks of arrays that users give: a clear exception, or an array as the engine takes it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

_LARGEST = 1e100  # m; coordinates beyond it would overflow in a product of three


def numbers(name: str, array: ArrayLike, shape: tuple[int | None, ...], what: str) -> NDArray[np.float64]:
    """float64, contiguous, in this machine's byte order, of this shape (None: any length), finite."""
    found = np.asarray(array)
    if found.dtype.kind not in "fiu":
        raise TypeError(f"{name}: found dtype {found.dtype}, expected real numbers: {what}")
    if found.ndim != len(shape) or any(want is not None and want != have for want, have in zip(shape, found.shape)):
        raise ValueError(f"{name}: found shape {found.shape}, expected {what}")
    taken = np.ascontiguousarray(found, dtype=np.float64)
    if not np.isfinite(taken).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(taken))[0])
        raise ValueError(f"{name}: found {taken[place]} at {place}, expected finite numbers")
    return taken


def points(name: str, array: ArrayLike, count: int | None = None) -> NDArray[np.float64]:
    """(N, 3) m."""
    taken = numbers(name, array, (count, 3), "(N, 3) points" if count is None else f"({count}, 3) points")
    if taken.size and float(np.abs(taken).max()) > _LARGEST:
        raise ValueError(f"{name}: found a coordinate beyond {_LARGEST:g}")
    return taken


def triangles(name: str, array: ArrayLike, vertices: int) -> NDArray[np.uint32]:
    """(M, 3) ids of vertices."""
    found = np.asarray(array)
    if found.dtype.kind not in "iu":
        raise TypeError(f"{name}: found dtype {found.dtype}, expected integers: (M, 3) ids of vertices")
    if found.ndim != 2 or found.shape[1] != 3:
        raise ValueError(f"{name}: found shape {found.shape}, expected (M, 3) ids of vertices")
    if found.size and not (0 <= int(found.min()) and int(found.max()) < vertices):
        raise ValueError(f"{name}: found ids from {found.min()} to {found.max()}, expected 0 to {vertices - 1}")
    return np.ascontiguousarray(found, dtype=np.uint32)
