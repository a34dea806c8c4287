"""Result types: named tuples of arrays in SI units, tension positive."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Sequence

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ._core import Scenario

Reals = NDArray[np.float64]


class Contacts(NamedTuple):
    """Contacts between particles, one row each, as input of operators."""

    pair: NDArray[np.uint32]
    """Particles A and B, shape (n, 2)."""
    branch: Reals
    """Branch vector from the center of A to that of B, periodic image included, m, (n, 3)."""
    point: Reals
    """Contact point, on the side of A in a periodic cell, m, (n, 3)."""
    force: Reals
    """Force on A, N, (n, 3)."""
    moment: Reals | None = None
    """Moment on A about the contact point, N m, (n, 3); None if there is none."""


class Loads(NamedTuple):
    """External loads on particles, such as those of walls and supports."""

    particle: NDArray[np.uint32]
    """The particle, shape (n,)."""
    point: Reals
    """Point where the force acts, m, (n, 3)."""
    force: Reals
    """Force on the particle, N, (n, 3)."""
    moment: Reals | None = None
    """Moment about the point, N m, (n, 3); None if there is none."""


class MeshState(NamedTuple):
    """A mesh: triangles whose vertices move on their own."""

    positions: Reals
    """Positions of the vertices, m, (n, 3)."""
    triangles: NDArray[np.uint32]
    """Vertices of each triangle, (m, 3)."""
    velocities: Reals
    """Velocities of the vertices in the last step, m/s, (n, 3)."""
    forces: Reals
    """Forces of the particles on the vertices in the last step, N, (n, 3)."""


class Forces(NamedTuple):
    """Forces of all contacts."""

    contacts: Contacts
    """Contacts between particles."""
    walls: Loads
    """Forces of walls on particles."""
    meshes: dict[str, Reals]
    """Forces of the particles on the vertices of each wall that is a mesh, by name, N, (n, 3)."""


class Bonds(NamedTuple):
    """Bonds, one row each, broken ones included."""

    pair: NDArray[np.uint32]
    """Particles A and B, by index, (n, 2)."""
    midpoint: Reals
    """Midpoint, m, (n, 3)."""
    normal: Reals
    """Unit vector along the bond, (n, 3)."""
    damage: Reals
    """Lost fraction of the stiffness, (n,)."""
    lost_strength: Reals
    """Lost fraction of the strength, (n,)."""


class RegionStress(NamedTuple):
    """Mean stress of a region."""

    stress: Reals
    """Stress, first index position, second force, Pa, (3, 3)."""
    volume: float
    """Volume of the region, m^3."""
    full: float
    """Number of contacts with full weight."""
    partial: float
    """Number of contacts with partial weight."""


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
    """Sum of moments about the particle centers over the volume, N/m^2, (3,)."""
    volume: float
    """Volume, m^3."""
    contacts: int
    """Number of contacts with both particles in the region."""


class Fabric(NamedTuple):
    """Fabric and coordination number of a region."""

    tensor: Reals
    """Fabric tensor, mean of n n over contacts, trace 1, (3, 3)."""
    contacts: float
    """Number of contacts."""
    particles: int
    """Number of particles with centers in the region."""
    coordination: float
    """Contacts per particle."""
    branch_length: float
    """Mean branch length, m."""


class PowerReport(NamedTuple):
    """Power of contacts, W: `contacts == stress + couple + gap`."""

    contacts: float
    """Power of the relative motion at contacts, W."""
    particles: float
    """The same, summed over particles, W."""
    stress: float
    """Power of the stress on the strain rate, W."""
    couple: float
    """Power of the couple stress on the curvature rate, W."""
    gap: float
    """Power of the non-affine motion, W."""
    stress_tensor: Reals
    """Stress, Pa, (3, 3)."""
    couple_stress: Reals
    """Couple stress, N/m, (3, 3)."""


class Emissions(NamedTuple):
    """Acoustic emissions, one row each, in the order of time."""

    time: Reals
    """Time of the first break, s, (n,)."""
    duration: Reals
    """From the first to the last break, s, (n,)."""
    position: Reals
    """Mean place of the breaks, weighted by their energy, m, (n, 3)."""
    breaks: NDArray[np.uint64]
    """Number of breaks, (n,)."""
    energy: Reals
    """Energy of the breaks, J, (n,)."""
    magnitude: Reals
    """Magnitude; minus infinity without energy, (n,)."""
    shear_share: Reals
    """Share of shear and twist in the energy, (n,)."""


class BValue(NamedTuple):
    """b-value of a set of events."""

    b: float
    """The b-value."""
    error: float
    """Its standard error."""
    completeness: float
    """Magnitude from which on events count."""
    events: int
    """Number of events that count."""


class Reloadings(NamedTuple):
    """Emission in reloadings, one row each."""

    former: Reals
    """Largest load before, (n,)."""
    time: Reals
    """When it was reached, s, (n,)."""
    least: Reals
    """Least load between, (n,)."""
    onset: Reals
    """Load from which on the specimen emits again, NaN if it does not, (n,)."""
    felicity: Reals
    """Felicity ratio, `onset` over `former`, (n,)."""


class SourceMechanism(NamedTuple):
    """What kind of source a moment tensor describes."""

    moment: float
    """Scalar moment, N m."""
    magnitude: float
    """Moment magnitude; minus infinity without moment."""
    isotropic: float
    """Share of expansion, -1 to 1."""
    dipole: float
    """Share of the compensated linear vector dipole, -1 to 1."""
    double_couple: float
    """Share of slip on a plane, 0 to 1."""


class CrackDirections(NamedTuple):
    """Directions of the area of cracks."""

    area: float
    """Area, m^2."""
    fabric: Reals
    """Fabric of the area, trace 1, (3, 3)."""
    principal: Reals
    """Principal values of the fabric, largest first, (3,)."""
    directions: Reals
    """Principal directions, one per row, (3, 3)."""
    density: Reals
    """Share of the area over that of cracks without preferred direction, by face of a sphere of 320 triangles, (320,)."""


class Fragments(NamedTuple):
    """Fragments, one row each, the heaviest first."""

    number: NDArray[np.uint32]
    """Number of the fragment, (n,)."""
    particles: NDArray[np.uint64]
    """Number of particles, (n,)."""
    mass: Reals
    """Mass, kg, (n,)."""
    position: Reals
    """Center of mass, m, (n, 3)."""
    velocity: Reals
    """Velocity of the center of mass, m/s, (n, 3)."""
    sphere: Reals
    """Diameter of the sphere (disc) with the volume of the particles, m, (n,)."""
    axes: Reals
    """Axes of the ellipsoid with the same moments, longest first, m, (n, 3); the third is zero in the plane."""


class SieveCurve(NamedTuple):
    """Shares of the mass below sizes."""

    size: Reals
    """Sizes, smallest first, m, (n,)."""
    passing: Reals
    """Share of the mass of fragments that are not larger, 0 to 1, (n,)."""


class SieveFit(NamedTuple):
    """Law of a sieve curve."""

    size: float
    """Its size, m: x' of Rosin and Rammler, k of Gaudin and Schuhmann."""
    size_error: float
    """Standard error of the size, m."""
    exponent: float
    """Its exponent."""
    exponent_error: float
    """Standard error of the exponent."""
    deviation: float
    """Largest difference from the sieve curve beyond the debris, as a share of the mass."""
    equal: float
    """Number of fragments of equal mass that would say as much."""


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
    """Check: equals the unit matrix up to rounding, (3, 3)."""


class Packing(NamedTuple):
    """Positions and radii of spheres, and their periodic cell."""

    positions: Reals
    """Positions, m, (n, 3)."""
    radii: Reals
    """Radii, m, (n,)."""
    cell: Reals | None = None
    """Edge vectors of the periodic cell as columns, m, (3, 3); None without a cell."""


class MemoizedPacking(NamedTuple):
    """A packing from a data base of YADE (memoizeDb), and the parameters by which YADE finds it."""

    packing: Packing
    """Positions and radii; the cell of periodic packings."""
    radius: float
    """Mean radius given to YADE, m; the radii of the spheres may have another mean."""
    radius_fuzz: float
    """Relative dispersion of the radii given to YADE (rRelFuzz): half the range over the mean."""
    dimensions: Reals
    """Edges of the periodic cell, or of the box around the requested shape, m, (3,)."""
    periodic: bool
    """Whether the packing is periodic."""
    time: float
    """Time of its making, s since 1970-01-01 UTC."""


class PackingSummary(NamedTuple):
    """Statistics of a packing."""

    spheres: int
    """Number of spheres."""
    packing_fraction: float | None
    """Solid fraction; None without a cell."""
    coordination: float
    """Mean number of neighbors per sphere within the interaction ratio."""
    coordination_of_backbone: float
    """The same without rattlers."""
    rattlers: int
    """Number of rattlers: spheres without load-bearing contacts."""
    mean_overlap: float
    """Mean overlap over the sum of radii."""
    largest_overlap: float
    """Largest overlap over the sum of radii."""


class Summary(NamedTuple):
    """Statistics of the particles and bonds of a scenario."""

    particles: int
    """Number of particles."""
    bonds: int
    """Number of bonds."""
    coordination: float
    """Mean number of bonds per particle."""
    packing_fraction: float | None
    """Solid fraction of the packing."""
    area: float | None
    """Cross-section of the loaded specimen, m^2."""
    length: float | None
    """Length of the loaded specimen, m."""
    largest_time_step: float
    """Time step bound, s."""
    spectral_radius: float | None
    """Spectral radius of the strain-force iteration of deformable particles; None if particles are rigid."""
    memory: int
    """Estimated peak memory of a run, bytes."""


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
    """Stiffness matrix, components 11, 22, 33, 23, 31, 12 with engineering shear strains, Pa, (6, 6)."""
    compliance: Reals
    """Compliance matrix, the inverse of the stiffness matrix, 1/Pa, (6, 6)."""
    anisotropy: float
    """Largest relative difference of Young's moduli."""


class ElasticAnswers(NamedTuple):
    """Elastic constants by several methods, from approximate to exact."""

    closed_form: tuple[float, float] | None
    """Young's modulus (Pa) and Poisson's ratio for an isotropic distribution of bonds; None for bonds with moments."""
    affine: ElasticConstants
    """Affine sum: all particles follow the mean strain. An upper bound."""
    static: ElasticConstants
    """Static equilibrium of all particles."""
    relaxed: ElasticConstants | None
    """Static equilibrium by dynamic relaxation; None without `dynamics`."""
    links: int
    """Number of bonds in the static network."""
    rattlers: int
    """Number of rattlers."""
    mechanisms: int
    """Number of zero-energy modes of single particles."""


class ElasticFit(NamedTuple):
    """Bond parameters that give the requested elastic constants."""

    normal: float
    """Modulus of the bonds (cpm, Pa), normal stiffness (linear_bond, N/m), or modulus of the beams (cohesive_beam, Pa)."""
    shear_ratio: float
    """Shear over normal stiffness; for beams, the sum of shear stiffnesses over the sum of normal stiffnesses."""
    achieved: ElasticConstants
    """Elastic constants of this packing with these parameters."""
    reach: tuple[float, float]
    """Smallest and largest Poisson's ratio that this packing can have."""
    rattlers: int
    """Number of rattlers."""
    parameters: dict[str, float]
    """Parameters in SI units by table and key of the material, such as "cpm.shear_ratio"."""
    spectral_radius: float | None
    """Spectral radius of the strain-force iteration of deformable particles; below 1 it converges. None if particles are rigid."""
    scenario: Scenario
    """The scenario with the found parameters."""


class BeamFit(NamedTuple):
    """Parameters of cohesive beams that give the requested properties."""

    young: float
    """Young's modulus of the beams, Pa."""
    radius_ratio: float
    """Radius of the beams over the mean radius of the particles."""
    sphere_density: float
    """Density of the spheres, kg/m^3."""
    strength: float | None
    """Strength of the beams, Pa."""
    achieved_young: float
    """Young's modulus of the specimen, Pa."""
    achieved_poisson: float
    """Poisson's ratio of the specimen."""
    achieved_strength: float | None
    """Tensile strength of the specimen, Pa."""
    scenario: str
    """A scenario with these parameters, TOML."""


class PointUpdate(NamedTuple):
    """The result of a step of a continuum law at n points."""

    stress: Reals
    """Stress, Pa, (n, 3, 3)."""
    state: Reals
    """State at the end of the step, (n, 8)."""
    damage: Reals
    """Damage, (n,)."""
    tangent: Reals | None
    """Consistent tangent, components 11, 22, 33, 23, 31, 12 with engineering shears, Pa, (n, 6, 6); None if not requested."""


class CellResponse(NamedTuple):
    """What n representative cells answer."""

    stress: Reals
    """Stress, first index position, second force, Pa, (n, 3, 3)."""
    couple_stress: Reals
    """Couple stress about the center of the cell, N/m, (n, 3, 3)."""
    damage_tensor: Reals | None
    """Damage tensor of the bonds, broken ones included, (n, 3, 3); None without bonds."""
    volume: Reals
    """Volume, m^3, (n,)."""
    bonds: NDArray[np.uint64]
    """Intact bonds, (n,)."""
    work: Reals
    """Work of this stress since the start of the cell, by the trapezoidal rule over its steps, J, (n,). Without the kinetic energy of the mean
    motion."""


class CellParticles(NamedTuple):
    """The particles of a representative cell."""

    position: Reals
    """Positions, m, (n, 3); somewhere, not always within the cell."""
    radius: Reals
    """Radii, m, (n,)."""
    edges: Reals
    """Edges of the cell as columns, m, (3, 3): images of a particle lie at the position plus ``edges @ integers``."""


class Check(NamedTuple):
    """What `concordem.check` finds."""

    summary: Summary
    """Numbers of particles and bonds, and the like."""
    time_step: float
    """Time step, s."""
    time_per_step: float
    """Measured time of a step, s."""
    steps: float | None
    """About the largest number of steps; None if the end depends on what happens."""
    limited_by: str | None
    """The key of ``[stop]`` that limits the steps: "time", "strain", "steps"."""
    estimated_time: float | None
    """Longest time of the run, s."""
    facts: dict[str, str]
    """All facts as the program prints them, by name."""


class Curve(NamedTuple):
    """A curve of all points of a sweep: one series of each run over another."""

    x: Reals
    """Abscissas, which all points share, shape (n,)."""
    y: Reals
    """Ordinates, shape (points, n); NaN where a run never reaches the abscissa."""
    x_name: str
    """Series of the abscissas, such as "strain"."""
    y_name: str
    """Series of the ordinates."""
    x_unit: str
    """SI unit of the abscissas; "1" for a pure number."""
    y_unit: str
    """SI unit of the ordinates."""


class Sweep(NamedTuple):
    """A finished sweep."""

    path: Path
    """Result file."""
    page: Path
    """Web page."""
    axes: dict[str, Reals | list[str]]
    """Value of each axis at each point, by its name: numbers, or texts."""
    points: NDArray[np.void]
    """Quantities of each point, a structured array; `concordem.units` gives the units."""
    problems: dict[int, str]
    """Why points failed, by their number."""
    curves: dict[str, Curve]
    """Curves of runs, by their name."""


class Key(NamedTuple):
    """A key of scenarios."""

    path: str
    """Path, such as "loading.strain_rate"."""
    value: str
    """What a value is: "length (m, cm, mm, um)", "integer", "word", "table"."""
    required: bool
    """Whether its table must have it."""
    description: str
    """Meaning, unit, default, and example."""
    words: dict[str, str]
    """Allowed words with their meaning."""
    kinds: list[str]
    """The values of ``kind`` with which its table has the key; empty if every table has it."""


class WallState(NamedTuple):
    """A wall at this moment."""

    displacement: Reals
    """Displacement since the start, m, (3,)."""
    velocity: Reals
    """Velocity, m/s, (3,)."""
    angular_velocity: Reals | None
    """Angular velocity about its axis, rad/s, (3,); None if it does not turn."""
    force: Reals
    """Force of the particles on the wall in the last step, N, (3,)."""
    torque: Reals
    """Its moment about the origin of the displaced wall, N m, (3,)."""


def _table(columns: Sequence[tuple[str, str, NDArray[Any]]]) -> NDArray[Any]:
    """A structured array; the type of each field has its unit as metadata."""
    formats = []
    for _, unit, values in columns:
        # Metadata must be on the type of the numbers, because NumPy drops it from subarrays.
        base = np.dtype(values.dtype, metadata={"unit": unit})
        formats.append((base, values.shape[1:]) if values.ndim > 1 else base)
    names = [name for name, _, _ in columns]
    table = np.empty(len(columns[0][2]), dtype=np.dtype({"names": names, "formats": formats}))
    for name, _, values in columns:
        table[name] = values
    return table


def _structured(table: Any) -> None:
    """Refuse what is no table of the package."""
    if not isinstance(table, np.ndarray) or not table.dtype.names:
        raise TypeError("give a structured array with named columns, such as simulation.events or state.contacts()['walls']")


def units(table: NDArray[Any]) -> dict[str, str]:
    """SI units of the fields of a table; "1" for dimensionless numbers.

    >>> import concordem
    >>> sim = concordem.Scenario.template("hertz-impact").simulation()
    >>> concordem.units(sim.samples)["stress"]
    'Pa'
    """
    _structured(table)
    found = {}
    for name in table.dtype.names or ():
        kind = table.dtype[name]
        base = kind.subdtype[0] if kind.subdtype else kind
        metadata: Any = base.metadata or {}
        found[name] = str(metadata.get("unit", "1"))
    return found
