"""Example 1: load a scene, drive a catheter, read what happens, fork.

    python examples/python/1_minimal.py [--quick]
"""

import sys

import numpy as np

import trocar

scene = trocar.load(trocar.scene_path("aortic_arch"), budget="work:20000")  # prepared once, immutable, shareable
sim = scene.simulator()
rod = sim.rod(0)  # a view: it follows every step

sim.drive(0, speed=0.03, turn=0.5)  # m/s, rad/s, held from step to step
for second in range(2 if "--quick" in sys.argv else 6):
    report = sim.step(100)
    print(f"{report.time:.1f} s: {1e3 * report.insertion:5.1f} mm in, tip at {np.round(1e3 * rod[-1], 1)} mm, {report.contacts} contacts, "
          f"{report.contact_force:.3f} N, exits {report.exits}")

fork = sim.fork()  # goes on to the same bits, or to others where it is driven otherwise
sim.step(50)
fork.step(50)
assert fork.hash == sim.hash
print(f"state {sim.hash}, the fork's too")
