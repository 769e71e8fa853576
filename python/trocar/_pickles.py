"""Pickle rules: a scene and a saved state travel between processes of the same build; a simulator does not."""

from __future__ import annotations

import copyreg
from typing import Any, Callable

from . import _engine
from ._build import build_id, require_same_build


def _restore_scene(build: str, source: tuple[str, str, str, int | None], model: str) -> _engine.Scene:
    require_same_build("the scene", build)
    file, text, budget, seed = source
    scene = _engine.load_scene(file, text, budget, seed)
    if scene.hash != model:
        raise ValueError(f"{file}: is not what it was when the scene was pickled: its model is {scene.hash}, then {model}; "
                         "expected unchanged scene, mesh and path files")
    return scene


def _restore_state(build: str, parts: tuple[bytes, list[Any]]) -> _engine.SavedState:
    require_same_build("the saved state", build)
    return _engine.saved_state_from(*parts)


def _reduce_scene(scene: _engine.Scene) -> tuple[Callable[..., _engine.Scene], tuple[Any, ...]]:
    return _restore_scene, (build_id(), scene._source(), scene.hash)


def _reduce_state(state: _engine.SavedState) -> tuple[Callable[..., _engine.SavedState], tuple[Any, ...]]:
    return _restore_state, (build_id(), state._parts())


def _refuse_simulator(_: _engine.Simulator) -> str:
    raise TypeError("a Simulator is not pickled; expected its scene and what its save() returns")


def install() -> None:
    """From here on pickle and copy know the engine's classes."""
    copyreg.pickle(_engine.Scene, _reduce_scene)
    copyreg.pickle(_engine.SavedState, _reduce_state)
    copyreg.pickle(_engine.Simulator, _refuse_simulator)
    for immutable in (_engine.Scene, _engine.SavedState):
        setattr(immutable, "__copy__", lambda self: self)
        setattr(immutable, "__deepcopy__", lambda self, memo: self)
