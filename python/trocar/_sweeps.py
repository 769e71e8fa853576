"""Many runs, one table: the program's `trocar sweep`."""

from __future__ import annotations

import csv
import os
import pathlib
import shutil
import subprocess
import tempfile
from typing import Any, Optional, Sequence, Union

import numpy as np
from numpy.typing import NDArray

from ._errors import Error

_PathLike = Union[str, "os.PathLike[str]"]


def find_program() -> str:
    """The program `trocar`: $TROCAR_PROGRAM, or the first on the PATH."""
    named = os.environ.get("TROCAR_PROGRAM")
    found = named if named else shutil.which("trocar")
    if not found:
        raise FileNotFoundError("the program trocar is not on the PATH; expected it there, or its file in TROCAR_PROGRAM")
    return found


def sweep(sweep: _PathLike, *, out: Optional[_PathLike] = None, jobs: int = 1, resume: bool = False, retry_failed: bool = False) -> NDArray[Any]:
    """Runs what a sweep file asks for, and returns its table: a structured array, a row per run in the plan's order.

    sweep         file (docs/sweep.md)
    out           folder of the plan and the results; a temporary one when absent
    jobs          runs at once, in processes of their own
    resume        run what is missing of the results that are in `out`; without any it starts from the beginning
    retry_failed  with resume: run what has failed again

    Fields have the names of the table's columns, as in table["/budget"]: float64 where all cells are numbers (NaN where one is
    empty), int64 for "repeat", and strings otherwise. Failed runs are rows with their reason in table["status"].
    """
    if jobs < 1:
        raise ValueError(f"jobs: found {jobs}, expected 1 or more")
    with tempfile.TemporaryDirectory(prefix="trocar-sweep-") as scratch:
        folder = pathlib.Path(scratch)
        table = folder / "table.csv"
        command: list[str] = [find_program(), "sweep", os.fspath(sweep), "--out", os.fspath(out if out is not None else folder / "results"),
                              "--jobs", str(jobs), "--collect", str(table), "--quiet"]
        command += ["--resume"] * resume + ["--retry-failed"] * retry_failed
        ended = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace")
        if ended.returncode != 0:
            said = [line[7:] for line in ended.stderr.splitlines() if line.startswith("error: ")]
            raise Error(said[-1] if said else f"trocar sweep ended with exit code {ended.returncode}: {ended.stderr.strip()[-300:]}",
                        "ToolFailed" if ended.returncode != 2 else "BadValue")
        return read_table(table)


def read_table(file: _PathLike) -> NDArray[Any]:
    """The table that `trocar sweep --collect` has written, as sweep() returns it."""
    with open(file, newline="", encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    names, cells = rows[0], rows[1:]
    columns = [_column(name, [row[i] for row in cells]) for i, name in enumerate(names)]
    table = np.empty(len(cells), dtype=[(name, column.dtype) for name, column in zip(names, columns)])
    for name, column in zip(names, columns):
        table[name] = column
    return table


def _column(name: str, cells: Sequence[str]) -> NDArray[Any]:
    if name == "repeat":
        return np.array([int(cell) for cell in cells], dtype=np.int64)
    if name not in ("status", "scene") and any(cells):
        try:
            return np.array([float(cell) if cell else np.nan for cell in cells], dtype=np.float64)
        except ValueError:
            pass
    return np.array(cells if cells else [""], dtype=np.str_)[: len(cells)]
