"""Simulations through pickle: a checkpoint in the bytes."""

from __future__ import annotations

import os
import tempfile
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._core import Scenario, Simulation

_Settings = tuple[int | None, Any, Any, bool]
"""Threads, laws of bonds and of contacts, and whether snapshots are kept."""


def reduced(simulation: Simulation, scenario: Scenario, settings: _Settings) -> tuple[Any, ...]:
    """What pickle stores of a simulation."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "state.h5")
        simulation.save(path)
        with open(path, "rb") as file:
            return _restored, (file.read(), scenario, settings)


def _restored(checkpoint: bytes, scenario: Scenario, settings: _Settings) -> Simulation:
    from ._core import Simulation

    threads, bond_law, contact_law, snapshots = settings
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "state.h5")
        with open(path, "wb") as file:
            file.write(checkpoint)
        return Simulation.load(path, scenario, threads, bond_law, contact_law, snapshots)
