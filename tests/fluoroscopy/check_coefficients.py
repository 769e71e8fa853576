#!/usr/bin/env python3
"""What a run says that matter attenuates, against xraylib at 60 keV. 77: that library is not installed.

usage: check_coefficients.py TROCAR FOLDER
"""
import json
import shutil
import subprocess
import sys
from pathlib import Path

try:
    import xraylib
except ImportError:
    print("skipped: python3-xraylib is not installed")
    sys.exit(77)

# mass fractions by atomic number; tissues as ICRU 44 has them
MATTER = {
    "tissue": (1060, {1: .102, 6: .143, 7: .034, 8: .708, 11: .002, 15: .003, 16: .003, 17: .002, 19: .003}),
    "blood": (1060, {1: .102, 6: .110, 7: .033, 8: .745, 11: .001, 15: .001, 16: .002, 17: .003, 19: .002, 26: .001}),
    "bone": (1920, {1: .034, 6: .155, 7: .042, 8: .435, 11: .001, 12: .002, 15: .103, 16: .003, 20: .225}),
    "nitinol": (6450, {28: .558, 22: .442}),
    "steel": (7900, {26: 1.0}),
}

trocar, folder = sys.argv[1], Path(sys.argv[2])
shutil.rmtree(folder, ignore_errors=True)
folder.mkdir(parents=True)
scene = {"name": "matter", "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 0.1}, "effects": [], "bodies": {},
         "outputs": {"fluoroscopy": {"every": 10, "views": [{"name": "ap", "pixels": [16, 16]}], "matter": {name: name for name in MATTER}}}}
for k, name in enumerate(MATTER):
    scene["bodies"][name] = {"kind": "static", "surface": {"shape": "sphere", "centre": [20 * k, 0, 0], "radius": 5, "subdivisions": 2}}
(folder / "scene.json").write_text(json.dumps(scene))
subprocess.run([trocar, "run", str(folder / "scene.json"), "--out", str(folder / "out"), "-n", "1", "--no-report"], check=True, stdout=subprocess.DEVNULL)
said = {body["name"]: body["attenuation_per_m"] for body in json.loads((folder / "out/summary.json").read_text())["fluoroscopy"]["bodies"]}
worst = 0.0
for name, (density, parts) in MATTER.items():
    wanted = 0.1 * density * sum(share * xraylib.CS_Total(z, 60.0) for z, share in parts.items())
    worst = max(worst, abs(said[name] / wanted - 1))
print(f"{len(MATTER)} kinds of matter within {100 * worst:.3f} % of xraylib")
assert worst < 1e-3
