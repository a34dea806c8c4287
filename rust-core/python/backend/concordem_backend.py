"""Builds the package with maturin, after the parts of the native YADE plugin.

pip calls it for a source package and for the folder rust-core/python. `make wheel` calls the script yade-bridge/native/build and
maturin itself.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import maturin
from maturin import *  # noqa: F403  (the other hooks)


def _cmake() -> list[str]:
    """CMake, which HDF5 needs, unless one runs here.

    That of another virtual environment is on the path, but does not run, because pip hides the packages of that environment.
    """
    try:
        runs = subprocess.run(["cmake", "--version"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
    except OSError:
        runs = False
    return [] if runs else ["cmake"]


def get_requires_for_build_wheel(config_settings: dict[str, Any] | None = None) -> list[str]:
    """What pip fetches to build a wheel."""
    return [*maturin.get_requires_for_build_wheel(config_settings), *_cmake()]


def get_requires_for_build_editable(config_settings: dict[str, Any] | None = None) -> list[str]:
    """What pip fetches for an editable installation."""
    return [*maturin.get_requires_for_build_editable(config_settings), *_cmake()]


def build_wheel(
    wheel_directory: str, config_settings: dict[str, Any] | None = None, metadata_directory: str | None = None
) -> str:
    """The wheel, with the parts of the native plugin on Linux, the only system of YADE."""
    if sys.platform == "linux":
        project = Path(__file__).resolve().parents[1]
        # The folder yade-bridge lies beside pyproject.toml in a source package, two folders higher in the repository.
        script = next(path for folder in (project, project.parents[1]) if (path := folder / "yade-bridge/native/build").is_file())
        parts = project / "python/concordem/yade/native"
        subprocess.run(["bash", str(script)], check=True, env={**os.environ, "PARTS": str(parts)}, stdout=sys.stderr)
    return maturin.build_wheel(wheel_directory, config_settings, metadata_directory)
