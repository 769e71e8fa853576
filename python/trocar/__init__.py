"""Trocar: time-critical, interactive surgical simulation.

    import trocar
    scene = trocar.load(trocar.scene_path("aortic_arch"), budget="work:20000")
    sim = scene.simulator()
    sim.drive(0, speed=0.03, turn=1.0)
    report = sim.step()

SI units: m, s, N, rad. Arrays that show a simulator's state are read-only views, float64 in C order; they keep it alive.
"""

from . import _pickles
from ._build import build_id
from ._engine import SavedState, Scene, Simulator, StepReport
from ._errors import Error, StoppedError
from ._functions import Plan, centreline, contacts, load, plan, scene_path, scenes
from ._sweeps import read_table, sweep
from .pictures import XrayFrame, xray
from .environments import Environments, Options, Rollout, RolloutResult, Task, rollout

_pickles.install()
for _class in (SavedState, Scene, Simulator, StepReport):
    _class.__module__ = "trocar"
del _class

__version__ = "1.0.0"
__all__ = ["Environments", "Error", "Options", "Plan", "Rollout", "RolloutResult", "SavedState", "Scene", "Simulator", "StepReport",
           "StoppedError", "Task", "XrayFrame", "build_id", "centreline", "contacts", "load", "plan", "read_table", "rollout", "scene_path", "scenes",
           "sweep", "xray"]
