"""trocar.sweep: the table of the command line as a structured array."""

import json
import pathlib

import numpy as np
import pytest
import trocar

SCENE = {
    "units": {"length": "mm"},
    "time": {"step": 0.01, "duration": 1},
    "bodies": {"ball": {"kind": "static", "surface": {"shape": "sphere", "radius": 10}}},
    "effects": ["coarse_contact"],
}


def write(folder: pathlib.Path, **sweep: object) -> pathlib.Path:
    (folder / "ball.json").write_text(json.dumps(SCENE))
    file = folder / "sweep.json"
    file.write_text(json.dumps({"scene": "ball.json", "options": ["-n", "2"], **sweep}))
    return file


def test_the_table_is_a_structured_array_in_the_plans_order(tmp_path: pathlib.Path) -> None:
    file = write(tmp_path, repeat=2, vary={"/budget": ["work:1", "exact"], "/bodies/ball/surface/radius": [5, 6.5]},
                 collect={"steps": "/steps", "hash": "/state_hash", "none": "/none"})
    table = trocar.sweep(file, jobs=2)
    assert table.dtype.names == ("/budget", "/bodies/ball/surface/radius", "repeat", "status", "steps", "hash", "none")
    assert table["/budget"].tolist() == ["work:1"] * 4 + ["exact"] * 4
    assert table["/bodies/ball/surface/radius"].tolist() == [5.0, 5.0, 6.5, 6.5] * 2
    assert table["repeat"].tolist() == [0, 1] * 4
    assert (table["status"] == "done").all()
    assert table["steps"].dtype == np.float64 and (table["steps"] == 2).all()
    assert (table["none"] == "").all()


def test_results_stay_in_a_named_folder_and_are_taken_up_again(tmp_path: pathlib.Path) -> None:
    file = write(tmp_path, collect={"hash": "/state_hash"})
    first = trocar.sweep(file, out=tmp_path / "out")
    assert (tmp_path / "out" / "plan.json").is_file()
    assert (trocar.sweep(file, out=tmp_path / "out", resume=True) == first).all()


def test_a_bad_sweep_is_an_error_with_its_place(tmp_path: pathlib.Path) -> None:
    with pytest.raises(trocar.Error, match="budgt.*budget"):
        trocar.sweep(write(tmp_path, vary={"/budgt": ["exact"]}))
    with pytest.raises(ValueError, match="jobs"):
        trocar.sweep(write(tmp_path), jobs=0)
