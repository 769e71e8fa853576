"""Every example, shortened; and what mypy says of them."""

from __future__ import annotations

import importlib.util
import pathlib
import subprocess
import sys

import pytest

from conftest import SOURCE

EXAMPLES = sorted((SOURCE / "examples" / "python").glob("[0-9]*.py"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(example, tmp_path):
    run = subprocess.run([sys.executable, example, "--quick"], cwd=tmp_path, capture_output=True, text=True, timeout=400)
    assert run.returncode == 0, run.stdout + run.stderr
    assert run.stdout.strip()


def test_the_bench_runs():
    run = subprocess.run([sys.executable, "-m", "trocar.bench", "--quick"], capture_output=True, text=True, timeout=400)
    assert run.returncode == 0 and "binding: of a step" in run.stdout, run.stdout + run.stderr


def test_the_package_and_the_examples_are_typed(tmp_path):
    if importlib.util.find_spec("mypy") is None:
        pytest.skip("mypy is not installed")
    for files in ([SOURCE / "python" / "trocar"], *[[example] for example in EXAMPLES]):
        run = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path), *map(str, files)], cwd=SOURCE,
                             env={"MYPYPATH": str(SOURCE / "python"), "PATH": "/usr/bin:/bin"}, capture_output=True, text=True, timeout=200)
        assert run.returncode == 0, run.stdout + run.stderr


def test_the_stub_names_what_the_module_has():
    import ast

    import trocar
    stub = ast.parse((pathlib.Path(trocar.__file__).parent / "_engine.pyi").read_text())
    for node in stub.body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            real = getattr(trocar._engine, node.name)
            if isinstance(node, ast.ClassDef):
                missing = [f.name for f in node.body if isinstance(f, ast.FunctionDef) and not hasattr(real, f.name)]
                public = {name for name in vars(real) if not name.startswith("_")}
                assert not missing and public <= {f.name for f in node.body if isinstance(f, ast.FunctionDef)}, (node.name, missing)
    named = {node.name for node in stub.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert {name for name in vars(trocar._engine) if not name.startswith("_")} == named
