"""Which build of the engine this is."""

from __future__ import annotations

import functools
import hashlib

from . import _engine


@functools.lru_cache(maxsize=None)
def build_id() -> str:
    """32 hex digits over the bytes of the engine's module: two builds that could differ in a bit differ in it."""
    digest = hashlib.blake2b(digest_size=16)
    with open(str(_engine.__file__), "rb") as module:
        while block := module.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def require_same_build(what: str, build: str) -> None:
    """Raises where something was pickled by another build."""
    if build != build_id():
        raise ValueError(f"{what} was pickled by another build of trocar ({build[:8]}, this one is {build_id()[:8]}); "
                         "expected the same build in both processes")
