"""Example 5: plots of one run with matplotlib: the catheter in its vessel, forces, and the time that steps take.

    python examples/python/5_plots.py [--quick] [picture.png]
"""

from __future__ import annotations

import pathlib
import sys

import matplotlib

matplotlib.use("Agg")  # no display is needed
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

import trocar  # noqa: E402

quick = "--quick" in sys.argv
names = [argument for argument in sys.argv[1:] if not argument.startswith("-")]
picture = pathlib.Path(names[0] if names else "out/python_run.png")
picture.parent.mkdir(parents=True, exist_ok=True)

scene = trocar.load(trocar.scene_path("aortic_arch"), budget="exact")
sim = scene.simulator()  # its script follows the centreline to the left carotid artery
wall, rod = sim.surface("vessel"), sim.rod(0)
shapes, times, forces, ms = [], [], [], []
for step in range(200 if quick else 1500):
    report = sim.step()
    times.append(report.time)
    forces.append(report.contact_force)
    ms.append(report.ms["total"])
    if step % 150 == 0:
        shapes.append(rod.copy())
shapes.append(rod.copy())

figure = plt.figure(figsize=(11, 5))
view = figure.add_subplot(1, 2, 1)
view.plot(*(1e3 * wall[::7, [0, 2]]).T, ",", color="0.75")
for share, shape in zip(np.linspace(0.2, 1.0, len(shapes)), shapes):
    inside = shape[shape[:, 2] > 0.0]
    view.plot(*(1e3 * inside[:, [0, 2]]).T, color=plt.get_cmap("viridis")(share))
view.plot(*(1e3 * scene.targets["left_carotid"][[0, 2]]), "r+", markersize=12)
view.set_aspect("equal")
view.set_xlabel("x, mm")
view.set_ylabel("z, mm")
force = figure.add_subplot(2, 2, 2)
force.plot(times, forces)
force.set_ylabel("force on the wall, N")
cost = figure.add_subplot(2, 2, 4)
cost.semilogy(times, ms, ",")
cost.set_ylabel("time of a step, ms")
cost.set_xlabel("simulated time, s")
figure.tight_layout()
figure.savefig(picture, dpi=100)
print(f"{picture}: {len(times)} steps, tip to target {1e3 * report.target_distance:.1f} mm, median step {np.median(ms):.2f} ms")
