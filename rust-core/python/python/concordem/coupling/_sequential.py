"""Sequential coupling: the state of a packing becomes the state of a continuum (Stránský 2018, chapter 6)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import operators
from .._core import DamagePlastic, handover_damage, handover_tensor
from .._errors import CouplingError

if TYPE_CHECKING:
    from .._core import Region, Simulation

Reals = NDArray[np.float64]


class HandOver(NamedTuple):
    """What the continuum takes over at n points."""

    stress: Reals
    """Mean stress of the packing, symmetric part, Pa, (n, 3, 3)."""
    damage_tensor: Reals
    """Damage tensor, (n, 3, 3)."""
    damage: Reals
    """Damage, (n,)."""
    states: Reals
    """States of the damage-plastic model, (n, 8): plastic strain, hardening and damage variable."""
    bonds: NDArray[np.int64]
    """Number of bonds of each point, broken ones included, (n,)."""


def hand_over(
    simulation: Simulation,
    law: DamagePlastic,
    regions: list[Region],
    size: ArrayLike,
    formulas: Literal["printed", "coded"] = "printed",
    volumes: ArrayLike | None = None,
) -> HandOver:
    """State of the damage-plastic model at points whose neighborhoods are `regions` of a simulation with CPM bonds.

    The stress is the mean of each region; the damage tensor counts the bonds whose midpoints lie in it. `size`: of the elements, m, one
    or one per point. `volumes`: m^3, (n,), if a region reaches beyond the specimen; that of the regions by default. Raises CouplingError for regions without bonds, or bonds of another law.
    """
    if simulation.state.cell is not None:
        raise CouplingError("the hand-over takes specimens with a surface; for a periodic cell use RepresentativeCells", "Periodic")
    positions = simulation.state.positions
    if "cpm" not in simulation.state.contacts():
        raise CouplingError("the hand-over needs bonds of the law cpm; their lost strength is its damage", "NoBonds")
    bonds = simulation.bonds()
    forces = simulation.forces()
    count = len(regions)
    stress, tensor = np.empty((count, 3, 3)), np.empty((count, 3, 3))
    found = np.empty(count, dtype=np.int64)
    filled = np.array([region.volume for region in regions]) if volumes is None else np.asarray(volumes, dtype=float)
    if filled.shape != (count,) or not (filled > 0).all():
        raise ValueError(f"volumes has shape {filled.shape}; give ({count},) positive numbers")
    for k, region in enumerate(regions):
        member = np.array([region.contains(point) for point in bonds.midpoint])
        found[k] = int(member.sum())
        if not member.any():
            raise CouplingError(f"region {k} contains no bond; enlarge it", "NoBonds")
        mean = operators.region_stress(positions, forces.contacts, region).stress * (region.volume / filled[k])
        stress[k] = 0.5 * (mean + mean.T)
        tensor[k] = handover_tensor(bonds.normal[member], bonds.lost_strength[member], formulas)
    damage = handover_damage(tensor, formulas)
    return HandOver(stress, tensor, damage, law.hand_over(stress, damage, size), found)

