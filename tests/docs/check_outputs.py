#!/usr/bin/env python3
"""Keys and columns of files that docs/outputs.md describes by hand, against those that the program writes: check_outputs.py PROGRAM"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
CUBE = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
FACES = [(1, 4, 3), (1, 2, 4), (5, 8, 6), (5, 7, 8), (1, 6, 2), (1, 5, 6), (3, 8, 7), (3, 4, 8), (1, 7, 5), (1, 3, 7), (2, 8, 4), (2, 6, 8)]


def cube(shift):
    return "".join(f"v {10 * x + shift} {10 * y} {10 * z}\n" for x, y, z in CUBE) + "".join("f %d %d %d\n" % face for face in FACES)


def described(heading):
    """Names in the first column of the table below a heading."""
    page = (ROOT / "docs/outputs.md").read_text()
    section = re.split(r"^## ", page, flags=re.M)
    section = next(part for part in section if part.startswith(heading))
    return re.findall(r"^\| `([^`]+)` \|", section, flags=re.M)


def main():
    program, wrong = sys.argv[1], []

    def compare(what, written):
        if set(described(what)) != set(written):
            wrong.append(f"{what}: described {sorted(described(what))}, written {sorted(written)}")

    with tempfile.TemporaryDirectory() as folder:
        place = pathlib.Path(folder)
        for name, shift in (("a0", 0), ("a1", 0), ("b0", 15), ("b1", 5)):
            (place / f"{name}.obj").write_text(cube(shift))
        run = lambda *words: subprocess.run([program, *words], cwd=folder, check=True, capture_output=True)
        run("prepare", "a0.obj", "--unit", "mm", "--out", "made")
        compare("prepare.json", json.loads((place / "made/prepare.json").read_text()).keys())
        run("contacts", "a0.obj", "a1.obj", "b0.obj", "b1.obj", "--out", "contacts.csv")
        header, *rows = (place / "contacts.csv").read_text().splitlines()
        compare("contacts --out", header.split(",") + ["frame"])  # that of sequences alone
        if not rows:
            wrong.append("the cubes do not meet")
    print("\n".join(wrong) or "described as written")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
