#!/usr/bin/env python3
"""Runs the program and watches its resident memory: does it grow from step to step?

    tests/memory/watch.py PROGRAM run SCENE [OPTIONS...]      e.g. build/release/trocar run assets/scenes/hepatic.json

Output goes to a folder that is removed again. Counted are the samples while rows are added to steps.csv: preparation takes
what it takes. Fails (exit 1) where the largest resident memory of the last quarter is more than 2 % above that of the second: the first
one still learns how long lists become, and what the run keeps for its report (32 bytes a step and curve) stays far below that.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

MOST_GROWTH = 1.02  # [-]
EVERY_S = 0.25


def resident_mib(pid):
    try:
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) / 1024.0
    except (FileNotFoundError, ProcessLookupError):
        pass
    return None


def count_rows(table):
    try:
        with table.open("rb") as file:
            return max(sum(1 for _ in file) - 1, 0)
    except FileNotFoundError:
        return 0


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory(prefix="trocar-memory-") as folder:
        out = Path(folder) / "out"
        with (Path(folder) / "said").open("w+") as said:
            process = subprocess.Popen(sys.argv[1:] + ["--out", str(out), "--no-pictures"], stdout=said, stderr=subprocess.STDOUT)
            samples = []  # (rows, MiB)
            while process.poll() is None:
                rows = count_rows(out / "steps.csv.partial")
                memory = resident_mib(process.pid)
                if rows > 0 and memory is not None:
                    samples.append((rows, memory))
                time.sleep(EVERY_S)
            said.seek(0)
            text = said.read()
        if process.returncode != 0 or len(samples) < 16:
            sys.exit(f"{text}exit {process.returncode}, {len(samples)} samples; expected a longer run")
    quarters = [samples[len(samples) * k // 4 : len(samples) * (k + 1) // 4] for k in range(4)]
    for part in quarters:
        print(f"rows {part[0][0]:>7} to {part[-1][0]:>7}: {min(m for _, m in part):.1f} to {max(m for _, m in part):.1f} MiB")
    growth = max(m for _, m in quarters[3]) / max(m for _, m in quarters[1])
    print(f"last quarter over second: {growth:.4f}, at most {MOST_GROWTH}")
    sys.exit(1 if growth > MOST_GROWTH else 0)


if __name__ == "__main__":
    main()
