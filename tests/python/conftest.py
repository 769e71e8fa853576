"""Scenes that tests share: each is prepared once."""

from __future__ import annotations

import os
import pathlib
import sys

import pytest

HERE = pathlib.Path(__file__).resolve().parent
try:
    import gymnasium  # noqa: F401
except ImportError:
    sys.path.insert(0, str(HERE / "stand_in"))  # its API's rules

import trocar  # noqa: E402

PROGRAM = os.environ.get("TROCAR_PROGRAM", "")
SOURCE = HERE.parent.parent


def box_vessel() -> dict:
    """A straight vessel: small, quick to prepare."""
    return {
        "name": "tube", "units": {"length": "mm", "pressure": "MPa"}, "time": {"step": 0.01, "duration": 2}, "budget": {"limit": "work:20000"},
        "bodies": {"vessel": {"kind": "static", "hollow": True,
                              "surface": {"shape": "tube", "axis": [[0, 0, 0, 4], [0, 0, 60, 4]], "sides": 16}}},
        "instruments": {"wire": {"length": 120, "radius": 0.5, "young_modulus": 60, "segment": 2.5, "skin_triangles": 600, "inserted": 8,
                                 "tip": {"shape": "J", "length": 10, "angle": 0.6, "stiffness": 0.3},
                                 "entry": {"position": [0, 0, 4], "direction": [0, 0, 1]}, "lumen": "vessel"}},
        "targets": {"end": {"position": [0, 0, 45]}},
        "effects": ["coarse_contact", "exact_contact", "friction"],
    }


@pytest.fixture(scope="session")
def tube() -> trocar.Scene:
    return trocar.load(box_vessel())


@pytest.fixture(scope="session")
def arch() -> trocar.Scene:
    return trocar.load(trocar.scene_path("aortic_arch"), budget="work:20000")


@pytest.fixture(scope="session")
def hepatic() -> trocar.Scene:
    return trocar.load(trocar.scene_path("hepatic"), budget="work:20000")
