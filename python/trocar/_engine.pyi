"""The compiled part of trocar."""

from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

class Scene:
    """A prepared scene: immutable, shared by its simulators."""
    @property
    def name(self) -> str:
        """Of the scene."""
    @property
    def file(self) -> str:
        """That it was read from."""
    @property
    def step(self) -> float:
        """s, simulated by one step."""
    @property
    def step_count(self) -> int:
        """Steps of the scene's duration."""
    @property
    def budget(self) -> str:
        """Of a step, as load() takes it."""
    @property
    def bodies(self) -> list[str]:
        """Names, in the scene's order."""
    @property
    def instruments(self) -> list[str]:
        """Names, in the scene's order."""
    @property
    def targets(self) -> dict[str, NDArray[np.float64]]:
        """(3,) m, at rest."""
    @property
    def notices(self) -> list[str]:
        """What was noticed while it was prepared."""
    @property
    def seconds(self) -> float:
        """s, that preparing took."""
    @property
    def hash(self) -> str:
        """Of the prepared model, 16 hex digits."""
    @property
    def drive_limits(self) -> list[tuple[float, float]]:
        """(m/s, rad/s) of each instrument."""
    def triangles(self, body: str) -> NDArray[np.uint32]:
        """(M, 3) vertices of the triangles of a body's surface."""
    def explain(self) -> str:
        """The text of `trocar explain`."""
    def simulator(self, budget: Optional[str] = None) -> Simulator:
        """A simulator at the scene's start."""
    def _source(self) -> tuple[str, str, str, Optional[int]]: ...

class StepReport:
    """What one step did: a copy of its own."""
    @property
    def step(self) -> int:
        """Number of the step, from 1; 0 before the first."""
    @property
    def time(self) -> float:
        """s, at the end of the step."""
    @property
    def tip(self) -> NDArray[np.float64]:
        """(3,) m: tip of the first instrument."""
    @property
    def insertion(self) -> float:
        """m"""
    @property
    def rotation(self) -> float:
        """rad"""
    @property
    def contact_force(self) -> float:
        """N, sum of the normal forces on walls."""
    @property
    def max_contact_force(self) -> float:
        """N, at one place."""
    @property
    def friction_force(self) -> float:
        """N"""
    @property
    def exact(self) -> bool:
        """The exact stage gave this step's answer."""
    @property
    def contacts(self) -> int:
        """Places where instruments press on walls."""
    @property
    def exact_contacts(self) -> int:
        """Contacts that continuous tests found."""
    @property
    def exits(self) -> int:
        """Instrument vertices outside the lumen, by an independent test."""
    @property
    def unresolved(self) -> int:
        """Continuous tests without a verdict."""
    @property
    def assumed(self) -> int:
        """Untested sphere pairs that count as contacts."""
    @property
    def unproven(self) -> int:
        """Links of instruments that nothing proved free."""
    @property
    def safe_fraction(self) -> float:
        """Share of the step's motion that was taken, 0..1."""
    @property
    def target_distance(self) -> float:
        """m; negative: none."""
    @property
    def kinetic(self) -> float:
        """J"""
    @property
    def elastic(self) -> float:
        """J"""
    @property
    def min_volume_ratio(self) -> float:
        """Smallest volume of a tetrahedron over its volume at rest."""
    @property
    def inverted_tets(self) -> int:
        """Tetrahedra whose volume is 0 or less."""
    @property
    def substeps(self) -> int:
        """Of the tissue's integration."""
    @property
    def budget_kept(self) -> bool:
        """What was charged is within the budget."""
    @property
    def work_units(self) -> int:
        """Units of work that the step took."""
    @property
    def finite(self) -> bool:
        """False: a state left its bounds."""
    @property
    def failure(self) -> str:
        """Then the body, element and number."""
    @property
    def ms(self) -> dict[str, float]:
        """Wall time of the stages, ms."""

class SavedState:
    """All that a simulator needs to go on to the same bits."""
    @property
    def step(self) -> int:
        """Number of the step, from 1; 0 before the first."""
    @property
    def time(self) -> float:
        """s"""
    @property
    def hash(self) -> str:
        """16 hex digits, as Simulator.hash."""
    def _parts(self) -> tuple[bytes, list[Any]]: ...

class Simulator:
    """One run of a scene. Calls from several threads follow one another."""
    @property
    def scene(self) -> Scene:
        """That it simulates."""
    @property
    def budget(self) -> str:
        """Of a step, as load() takes it."""
    @property
    def report(self) -> StepReport:
        """Of the last step."""
    @property
    def hash(self) -> str:
        """Of the state, 16 hex digits: the `state_hash` of `trocar run`."""
    def drive(self, instrument: Union[int, str], speed: float = 0.0, turn: float = 0.0) -> None:
        """From now on the handle is pushed at `speed` (m/s) and turned at `turn` (rad/s), within its limits."""
    def release(self, instrument: Union[int, str]) -> None:
        """From now on the scene's own script drives the instrument."""
    def step(self, count: int = 1) -> StepReport:
        """Takes steps, and returns the last one's report."""
    def save(self) -> SavedState:
        """The state, for load() or trocar.rollout."""
    def load(self, state: SavedState) -> None:
        """Goes on from a state of the same scene."""
    def fork(self) -> Simulator:
        """Another simulator in the same state: the same bits from here."""
    def rod(self, instrument: Union[int, str] = 0) -> NDArray[np.float64]:
        """(N, 3) m, read-only view: nodes of the rod, the tip last."""
    def skin(self, instrument: Union[int, str] = 0) -> NDArray[np.float64]:
        """(N, 3) m, read-only view: vertices of the instrument's surface."""
    def surface(self, body: Union[int, str]) -> NDArray[np.float64]:
        """(N, 3) m, read-only view: vertices of a body's surface."""
    def render(self, view: Optional[str] = None) -> NDArray[Any]:
        """(rows, columns) uint16 or uint8: the X-ray frame of a view of the scene's outputs.fluoroscopy."""
    def _xray(self, view: str) -> dict[str, Any]: ...
    def contacts(self) -> NDArray[Any]:
        """Structured array, of its own: body_a, body_b, origin, point (3) m, normal (3), gap m, time, force (3) N."""

class Task:
    """Navigation in one scene: what its episodes share."""
    def __init__(self, scene: Scene, options: dict[str, Any]) -> None: ...
    @property
    def scene(self) -> Scene: ...
    def describe(self) -> dict[str, Any]: ...
    def tree(self) -> dict[str, Any]: ...
    def write_manifest(self, folder: str, seed: int, files: list[str]) -> None: ...

class Batch:
    """Environments side by side on a pool of threads."""
    def __init__(self, tasks: list[list[Task]], threads: int, autoreset: int, copy: bool, pixels: Optional[dict[str, Any]]) -> None: ...
    def reset(self, seeds: list[Optional[int]], mask: list[int]) -> Any: ...
    def step(self, actions: Any) -> Any: ...
    def save(self, index: int) -> SavedState: ...
    def rods(self, index: int) -> list[NDArray[np.float64]]: ...
    def xray(self, index: int) -> dict[str, Any]: ...
    def failure(self, index: int) -> str: ...
    def episode(self, index: int) -> tuple[str, str]: ...
    def __len__(self) -> int: ...
    @property
    def observation(self) -> NDArray[np.float32]: ...
    @property
    def has_more_to_tell(self) -> bool: ...
    @property
    def final_observation(self) -> NDArray[np.float32]: ...
    @property
    def pixels(self) -> NDArray[np.uint8]: ...
    @property
    def tips(self) -> NDArray[np.float64]: ...
    @property
    def final_pixels(self) -> NDArray[np.uint8]: ...
    @property
    def outcome(self) -> NDArray[Any]: ...
    @property
    def devices(self) -> int: ...
    @property
    def engine_ms(self) -> float: ...

def walk_memory(megabytes: int) -> float: ...

class Rollout:
    """Sequences of drive commands from many states, on a pool of threads."""
    def __init__(self, scene: Scene, threads: int) -> None: ...
    def run(self, states: list[SavedState], actions: NDArray[np.float64], steps: int, keep: bool) -> dict[str, Any]: ...

def choose_isa(isa: str) -> bool:
    """avx512, "avx2", "portable", or empty for the best: of the tissue's kernels, in the whole process. False: this processor has it not."""

def hash_bytes(bytes: bytes) -> str: ...
def load_scene(file: str, text: str, budget: str, anatomy_seed: Optional[int]) -> Scene: ...
def saved_state_from(bytes: bytes, drives: list[Any]) -> SavedState: ...
def plan(scene: Scene, target: str, time_limit: float) -> dict[str, Any]: ...
def contacts(surfaces: list[Any], within: bool, distance: float, threads: int) -> NDArray[Any]: ...
def centreline(scene: Scene, target: str, instrument: int) -> NDArray[np.float64]: ...
