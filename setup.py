"""Builds the engine's module with CMake, where pip asks for it."""

import os
import pathlib
import shutil
import subprocess

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parent
RELEASE = ROOT / "build" / "release"
BUILD = RELEASE if (RELEASE / "build.ninja").is_file() else ROOT / "build" / "python"  # the engine's own, where it is there


class CMakeBuild(build_ext):
    """The package as the build directory holds it: module, assets."""

    def run(self):
        if not (BUILD / "build.ninja").is_file():
            self.call("cmake", "-S", str(ROOT), "-B", str(BUILD), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DTROCAR_TESTS=OFF")
        jobs = os.environ.get("TROCAR_JOBS", str(os.cpu_count() or 1))
        self.call("cmake", "--build", str(BUILD), "-j", jobs, "--target", "trocar_python_package")
        self.copy_extensions_to_build()

    @staticmethod
    def call(*command):
        try:
            subprocess.run(command, cwd=ROOT, check=True)
        except FileNotFoundError:
            raise SystemExit(f"{command[0]} is not installed; ./start python installs what the build needs") from None
        except subprocess.CalledProcessError as error:
            raise SystemExit(f"{' '.join(command)} ended with exit code {error.returncode}; its first error above names the cause") from None

    def copy_extensions_to_build(self):
        target = pathlib.Path(self.get_ext_fullpath("trocar._engine")).parent
        made = BUILD / "python" / "trocar"
        modules = list(made.glob("_engine.*.so"))
        if len(modules) != 1:
            raise SystemExit(f"{made}: found {len(modules)} modules, expected one; are python3-dev and pybind11-dev installed?")
        target.mkdir(parents=True, exist_ok=True)
        shutil.copy2(modules[0], target)
        for file in [*(ROOT / "python" / "trocar").glob("*.pyi"), ROOT / "python" / "trocar" / "py.typed"]:
            shutil.copy2(file, target)
        shutil.copytree(made / "assets", target / "assets", dirs_exist_ok=True)


setup(ext_modules=[Extension("trocar._engine", sources=[])], cmdclass={"build_ext": CMakeBuild})
