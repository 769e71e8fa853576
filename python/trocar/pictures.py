"""X-ray frames as arrays: the picture, masks, depth, and where the instruments are in it."""

from __future__ import annotations

import dataclasses
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from . import _engine


@dataclasses.dataclass(frozen=True)
class XrayFrame:
    """All that one frame says. Pixels: u runs right, v down, the first pixel's centre is (0.5, 0.5); NaN: not before the source."""

    image: NDArray[Any]  #: (rows, columns) uint8 or uint16, as the view's display shows it
    device: NDArray[np.uint8]  #: (rows, columns) 255 where an instrument attenuates, 0 elsewhere
    vessel: NDArray[np.uint8]  #: (rows, columns) 255 where a vessel does
    depth: NDArray[np.uint16]  #: (rows, columns) where rays first meet a body: 65535 is the source-detector distance along the axis, 0 nowhere
    projection: NDArray[np.float64]  #: (3, 4) metres to pixels: (u w, v w, w) = P (x, y, z, 1)
    primary: float  #: rad, + LAO
    secondary: float  #: rad, + CRA
    tips: NDArray[np.float64]  #: (devices, 2) pixels
    centrelines: list[NDArray[np.float64]]  #: (N, 2) pixels of each device's inserted nodes, the tip last


def xray(simulator: _engine.Simulator, view: Optional[str] = None) -> XrayFrame:
    """The X-ray frame of a simulator's state: of a view of the scene's outputs.fluoroscopy, its first where none is named; of the whole patient from
    the front where the scene has none."""
    return XrayFrame(**simulator._xray(view or ""))


#: Of an observation, in the order of the engine's PixelChannel.
CHANNELS = ("image", "device", "vessel", "depth")
OBSERVATIONS = ("state", "pixels", "both")


def camera_of(observation: str, view: Optional[str], pixels: tuple[int, int], channels: Any, renders: bool) -> Optional[dict[str, Any]]:
    """What the engine's batch is told of its pictures; None: it takes none."""
    if observation not in OBSERVATIONS:
        raise ValueError(f"observation: found {observation!r}, expected one of {', '.join(OBSERVATIONS)}")
    if observation == "state" and not renders:
        return None
    chosen = [channels] if isinstance(channels, str) else list(channels)
    for channel in chosen:
        if channel not in CHANNELS:
            raise ValueError(f"channels: found {channel!r}, expected some of {', '.join(CHANNELS)}")
    if not chosen:
        raise ValueError(f"channels: found none, expected some of {', '.join(CHANNELS)}")
    size = list(pixels)
    if len(size) != 2 or not all(isinstance(edge, (int, np.integer)) and 8 <= edge <= 2048 for edge in size):
        raise ValueError(f"pixels: found {pixels!r}, expected columns and rows, 8 to 2048 each")
    taken = [CHANNELS.index(channel) for channel in chosen] if observation != "state" else []
    return {"view": view or "", "pixels": [int(edge) for edge in size], "channels": taken}
