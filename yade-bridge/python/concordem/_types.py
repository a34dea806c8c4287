"""What functions return: named tuples of arrays in SI units, tension positive."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Sequence

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ._core import Scenario

Reals = NDArray[np.float64]


class Contacts(NamedTuple):
    """Contacts between particles, one row each, as operators read them."""

    pair: NDArray[np.uint32]
    """Particles A and B, shape (n, 2)."""
    branch: Reals
    """From the centre of A to that of B, image included, m, (n, 3)."""
    point: Reals
    """Contact point next to A, m, (n, 3)."""
    force: Reals
    """Force on A, N, (n, 3)."""
    moment: Reals | None = None
    """Moment on A about the contact point, N m, (n, 3); None if there is none."""


class Loads(NamedTuple):
    """Loads on particles from outside: walls, supports."""

    particle: NDArray[np.uint32]
    """The particle, shape (n,)."""
    point: Reals
    """Where the force acts, m, (n, 3)."""
    force: Reals
    """Force on the particle, N, (n, 3)."""
    moment: Reals | None = None
    """Moment about the point, N m, (n, 3)."""


class Forces(NamedTuple):
    """Forces of all contacts."""

    contacts: Contacts
    """Between particles."""
    walls: Loads
    """Of walls on particles."""


class RegionStress(NamedTuple):
    """Mean stress of a region."""

    stress: Reals
    """Stress, first index position, second force, Pa, (3, 3)."""
    volume: float
    """Volume of the region, m^3."""
    full: float
    """Contacts that counted in full."""
    partial: float
    """Contacts that counted in part."""


class ConjugateStress(NamedTuple):
    """Stress and couple stress conjugate to the affine modes of motion of a region."""

    stress: Reals
    """Stress, Pa, (3, 3)."""
    couple_stress: Reals
    """Couple stress about the reference point, N/m, (3, 3)."""
    rigid_force: Reals
    """Sum of forces over the volume, N/m^3, (3,)."""
    rigid_moment: Reals
    """Sum of moments over the volume, N/m^2, (3,)."""
    rotation: Reals
    """Sum of moments about the centres over the volume, N/m^2, (3,)."""
    volume: float
    """Volume, m^3."""
    contacts: int
    """Contacts with both particles inside."""


class Fabric(NamedTuple):
    """Contacts by number and direction."""

    tensor: Reals
    """Mean of n n, trace 1, (3, 3)."""
    contacts: float
    """Number of contacts."""
    particles: int
    """Particles whose centres lie inside."""
    coordination: float
    """Contacts per particle."""
    branch_length: float
    """Mean branch length, m."""


class PowerReport(NamedTuple):
    """Power of contacts, W: `contacts == stress + couple + gap`."""

    contacts: float
    """From relative motion at contacts."""
    particles: float
    """The same, summed over particles."""
    stress: float
    """Of the stress on the strain rate."""
    couple: float
    """Of the couple stress on the curvature rate."""
    gap: float
    """Of motion that is not affine."""
    stress_tensor: Reals
    """Stress, Pa."""
    couple_stress: Reals
    """Couple stress, N/m."""


class CoarseFields(NamedTuple):
    """Coarse-grained fields at points."""

    density: Reals
    """Mass density, kg/m^3, (n,)."""
    momentum: Reals
    """Momentum density, kg/(m^2 s), (n, 3)."""
    stress: Reals
    """Contact stress, Pa, (n, 3, 3)."""
    kinetic_stress: Reals
    """Kinetic stress, Pa, (n, 3, 3)."""


class MeshStrain(NamedTuple):
    """Strain of a triangulated body."""

    gradient: Reals
    """Mean displacement gradient, du_i/dx_j, (3, 3)."""
    volume: float
    """Volume, m^3."""
    cell_volumes: Reals
    """Volumes of the cells, m^3, (cells,)."""
    cell_moments: Reals
    """Volume times gradient of the cells, m^3, (cells, 3, 3)."""


class DualStrain(NamedTuple):
    """Strain by edges or faces and their dual vectors."""

    gradient: Reals
    """Displacement gradient, (3, 3)."""
    volume: float
    """Volume, m^3."""
    unity: Reals
    """What should be the unit matrix, (3, 3)."""


class Packing(NamedTuple):
    """Spheres, and the periodic cell they fill."""

    positions: Reals
    """Centres, m, (n, 3)."""
    radii: Reals
    """Radii, m, (n,)."""
    cell: Reals | None = None
    """Edge vectors of the periodic cell as columns, m; None without a cell."""


class PackingSummary(NamedTuple):
    """A packing in a few numbers."""

    spheres: int
    """Number of spheres."""
    packing_fraction: float | None
    """Share of solid; None without a cell."""
    coordination: float
    """Neighbours per sphere within the interaction ratio."""
    coordination_of_backbone: float
    """The same without rattlers."""
    rattlers: int
    """Spheres that carry nothing."""
    mean_overlap: float
    """Mean overlap over the sum of radii."""
    largest_overlap: float
    """Largest overlap over the sum of radii."""


class Summary(NamedTuple):
    """Facts about what was built from a scenario."""

    particles: int
    """Particles."""
    bonds: int
    """Bonds."""
    coordination: float
    """Bonds per particle."""
    packing_fraction: float | None
    """Share of solid of the packing."""
    area: float | None
    """Cross-section of the loaded specimen, m^2."""
    length: float | None
    """Its length, m."""
    largest_time_step: float
    """Stability bound, s."""
    spectral_radius: float | None
    """Of the strains of deformable particles; None if none deforms."""
    memory: int
    """Peak memory of a run, bytes, about."""


class ElasticConstants(NamedTuple):
    """Elastic constants of a periodic cell."""

    young: float
    """Mean Young's modulus, Pa."""
    poisson: float
    """Mean Poisson's ratio."""
    bulk: float
    """Bulk modulus, Pa."""
    shear: float
    """Mean shear modulus, Pa."""
    young_by_axis: Reals
    """Young's moduli along x, y, z, Pa."""
    shear_by_plane: Reals
    """Shear moduli 23, 31, 12, Pa."""
    stiffness: Reals
    """Stiffness, components 11, 22, 33, 23, 31, 12 with engineering shear strains, Pa, (6, 6)."""
    compliance: Reals
    """Its inverse, 1/Pa."""
    anisotropy: float
    """Largest relative difference of Young's moduli."""


class ElasticAnswers(NamedTuple):
    """Elastic constants, from crude to exact."""

    closed_form: tuple[float, float] | None
    """Young's modulus (Pa) and Poisson's ratio for all directions alike; None for links with moments."""
    affine: ElasticConstants
    """With all particles on the uniform field: an upper bound."""
    static: ElasticConstants
    """With all particles in equilibrium."""
    relaxed: ElasticConstants | None
    """The same by the dynamic solver; None if not asked for."""
    links: int
    """Links that took part."""
    rattlers: int
    """Particles that links do not hold."""
    mechanisms: int
    """Motions of single particles that no link resists."""


class ElasticFit(NamedTuple):
    """Stiffnesses for wanted elastic constants."""

    normal: float
    """Modulus of the links (cpm, Pa), normal stiffness (linear_bond, N/m), or modulus of the beams (cohesive_beam, Pa)."""
    shear_ratio: float
    """Shear over normal stiffness (of beams: sum over sum)."""
    achieved: ElasticConstants
    """What they give on this packing."""
    reach: tuple[float, float]
    """Least and largest Poisson's ratio of this packing."""
    rattlers: int
    """Particles that links do not hold."""
    parameters: dict[str, float]
    """What was found, SI units, by table and key of the material: "cpm.shear_ratio"."""
    spectral_radius: float | None
    """Of the iteration between strains and forces, of particles that were made deformable; below 1 they settle."""
    scenario: Scenario
    """The scenario with the found parameters."""


class BeamFit(NamedTuple):
    """Parameters of cohesive beams for wanted properties."""

    young: float
    """Young's modulus of the beams, Pa."""
    radius_ratio: float
    """Radius of the beams over the mean radius of the particles."""
    sphere_density: float
    """Density of the spheres, kg/m^3."""
    strength: float | None
    """Strength of the beams, Pa."""
    achieved_young: float
    """Young's modulus of the sample, Pa."""
    achieved_poisson: float
    """Poisson's ratio of the sample."""
    achieved_strength: float | None
    """Tensile strength of the sample, Pa."""
    scenario: str
    """A scenario with these parameters, TOML."""


def _table(columns: Sequence[tuple[str, str, NDArray[Any]]]) -> NDArray[Any]:
    """A structured array; each field's type carries its unit as metadata."""
    formats = []
    for _, unit, values in columns:
        # Metadata has to sit on the type of the numbers: NumPy drops it from subarrays.
        base = np.dtype(values.dtype, metadata={"unit": unit})
        formats.append((base, values.shape[1:]) if values.ndim > 1 else base)
    names = [name for name, _, _ in columns]
    table = np.empty(len(columns[0][2]), dtype=np.dtype({"names": names, "formats": formats}))
    for name, _, values in columns:
        table[name] = values
    return table


def units(table: NDArray[Any]) -> dict[str, str]:
    """SI units of the fields of a table ("1": a pure number).

    >>> import concordem
    >>> sim = concordem.Scenario.template("hertz-impact").simulation()
    >>> concordem.units(sim.samples)["stress"]
    'Pa'
    """
    found = {}
    for name in table.dtype.names or ():
        kind = table.dtype[name]
        base = kind.subdtype[0] if kind.subdtype else kind
        metadata: Any = base.metadata or {}
        found[name] = str(metadata.get("unit", "1"))
    return found
