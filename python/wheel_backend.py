"""How `pip` makes the wheel: maturin's, with qpgen and qpalgo in it, which maturin does not compile beside a module.

The clone's root and python/ are both described by python/pyproject.toml. With QUADPIXEL_MANYLINUX=1 the wheel is for every Linux from
2014 on (glibc 2.17, manylinux2014): Zig links it, against that C library.
"""

import os
import pathlib
import platform
import shutil
import subprocess
import sysconfig

import maturin

HERE = pathlib.Path(__file__).resolve().parent
SCRIPTS = HERE / "programs.data" / "scripts"
PROGRAMS = ("qpgen", "qpalgo")
MANYLINUX = os.environ.get("QUADPIXEL_MANYLINUX", "") not in ("", "0")
TARGET = f"{platform.machine()}-unknown-linux-gnu"


def _link_with_zig(target):
    """Has cargo and maturin link against glibc 2.17, but for what is only used to compile. At one place, else all would be compiled twice."""
    linker = target / TARGET / "zig-cc"
    linker.parent.mkdir(parents=True, exist_ok=True)
    linker.write_text(f'#!/bin/sh\nexec maturin zig cc -- -fno-sanitize=all -target {platform.machine()}-linux-gnu.2.17 "$@"\n')
    linker.chmod(0o755)
    os.environ["CC_" + TARGET.replace("-", "_")] = str(linker)
    os.environ["RUSTFLAGS"] = f"{os.environ.get('RUSTFLAGS', '')} -Clinker={linker}".strip()


def _add_programs():
    """Puts the programs, stripped, where pyproject.toml has maturin look for them."""
    root = HERE.parent
    target = root / os.environ.get("CARGO_TARGET_DIR", "target")
    suffix = sysconfig.get_config_var("EXE") or ""
    shutil.rmtree(SCRIPTS, ignore_errors=True)
    SCRIPTS.mkdir(parents=True)
    # With the module, so that the features of the libraries are the same and they are compiled once.
    compiled = ["cargo", "build", "--release", "--locked", "-p", "quadpixel-python", "-p", "quadpixel-cli", "--bins"]
    if MANYLINUX:
        _link_with_zig(target)
        compiled.append(f"--target={TARGET}")
        target = target / TARGET
    subprocess.run(compiled, cwd=root, check=True)
    for name in PROGRAMS:
        shutil.copy2(target / "release" / (name + suffix), SCRIPTS)
        if shutil.which("strip"):
            subprocess.run(["strip", str(SCRIPTS / (name + suffix))], check=True)


def get_requires_for_build_wheel(config_settings=None):
    os.chdir(HERE)
    return maturin.get_requires_for_build_wheel(config_settings) + (["ziglang"] if MANYLINUX else [])


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
    if MANYLINUX:
        config_settings = {**(config_settings or {}), "build-args": f"--target={TARGET} --compatibility manylinux2014"}
    return maturin.build_wheel(folder, config_settings, metadata)
