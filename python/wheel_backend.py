"""How `pip` makes the wheel: maturin's, with qpgen and qpalgo in it, which maturin does not compile beside a module.

The clone's root and python/ are both described by python/pyproject.toml.
"""

import os
import pathlib
import shutil
import subprocess
import sysconfig

import maturin

HERE = pathlib.Path(__file__).resolve().parent
SCRIPTS = HERE / "programs.data" / "scripts"
PROGRAMS = ("qpgen", "qpalgo")


def _add_programs():
    """Puts the programs, stripped, where pyproject.toml has maturin look for them."""
    root = HERE.parent
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", root / "target"))
    suffix = sysconfig.get_config_var("EXE") or ""
    shutil.rmtree(SCRIPTS, ignore_errors=True)
    SCRIPTS.mkdir(parents=True)
    # With the module, so that the features of the libraries are the same and they are compiled once.
    compiled = ["cargo", "build", "--release", "--locked", "-p", "quadpixel-python", "-p", "quadpixel-cli", "--bins"]
    subprocess.run(compiled, cwd=root, check=True)
    for name in PROGRAMS:
        shutil.copy2(target / "release" / (name + suffix), SCRIPTS)
        if shutil.which("strip"):
            subprocess.run(["strip", str(SCRIPTS / (name + suffix))], check=True)


def get_requires_for_build_wheel(config_settings=None):
    os.chdir(HERE)
    return maturin.get_requires_for_build_wheel(config_settings)


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    folder = os.path.abspath(metadata_directory)
    SCRIPTS.mkdir(parents=True, exist_ok=True)  # maturin asks for it
    os.chdir(HERE)
    return maturin.prepare_metadata_for_build_wheel(folder, config_settings)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    folder = os.path.abspath(wheel_directory)
    metadata = metadata_directory and os.path.abspath(metadata_directory)
    _add_programs()
    os.chdir(HERE)
    return maturin.build_wheel(folder, config_settings, metadata)
