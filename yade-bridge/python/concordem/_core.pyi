"""The solver. Arrays are NumPy's, in SI units; tension is positive."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, Protocol, TypeAlias, final

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from . import _types
from .laws import Law

_Reals: TypeAlias = NDArray[np.float64]
_Progress: TypeAlias = bool | Callable[[str, float], object] | None
_Truncation: TypeAlias = Literal["branch-clipped", "half-crossing", "internal-only"]
_Partition: TypeAlias = Literal["contact-point", "half-branch"]
_Formulas: TypeAlias = Literal["printed", "coded"]
_Path: TypeAlias = str | PathLike[str]

__all__ = [
    "__version__",
    "_panic",
    "AffineFit",
    "CellStates",
    "DamagePlastic",
    "Hosted",
    "Mesh",
    "Period",
    "PowerDiagram",
    "Region",
    "RepresentativeCells",
    "Result",
    "Scenario",
    "Simulation",
    "State",
    "affine_fit",
    "affine_forces",
    "affine_stiffness",
    "axial",
    "bagi_strain",
    "boundary_strain",
    "boundary_stress",
    "calibrate_cohesive_beam",
    "calibrate_elastic",
    "cell_gradient",
    "cell_strain",
    "characterise_file",
    "characterise_packing",
    "coarse_grain",
    "conjugate_stress",
    "coordination",
    "cosserat_strain",
    "couple_stress_external",
    "couple_stress_from_resultants",
    "couple_stress_internal",
    "damage_tensor",
    "delaunay",
    "elastic_constants",
    "fabric",
    "handover_damage",
    "handover_tensor",
    "hosted_text",
    "isotropic_moduli",
    "kinetic_stress",
    "lattice",
    "macro_rotation",
    "memory_gather",
    "memory_scatter",
    "memory_scatter_i32",
    "memory_targets",
    "moments_about_contact_points",
    "packing_summary",
    "particle_moments",
    "particle_strain",
    "particle_stress",
    "particle_volumes",
    "platen_strain",
    "power",
    "power_diagram",
    "random_dense",
    "read_packing",
    "region_stress",
    "region_stress_from_particles",
    "resultants",
    "run_program",
    "schema",
    "solid_fraction",
    "spatial_order",
    "strength_damage",
    "strength_damage_exponential",
    "voigt_plane",
    "wall_traction",
    "write_packing",
]

class _ContactsLike(Protocol):
    @property
    def pair(self) -> ArrayLike: ...
    @property
    def branch(self) -> ArrayLike: ...
    @property
    def point(self) -> ArrayLike: ...
    @property
    def force(self) -> ArrayLike: ...
    @property
    def moment(self) -> ArrayLike | None: ...

class _LoadsLike(Protocol):
    @property
    def particle(self) -> ArrayLike: ...
    @property
    def point(self) -> ArrayLike: ...
    @property
    def force(self) -> ArrayLike: ...
    @property
    def moment(self) -> ArrayLike | None: ...

__version__: str

def run_program(arguments: Sequence[str | PathLike[str]], code: str | PathLike[str]) -> int: ...
def schema(kind: str = "scenario") -> str: ...
def _law_conformance(
    law: Law,
    bonded: bool,
    geometry: Sequence[float],
    elastic: Sequence[float],
    inelastic: Sequence[float],
    held: Sequence[float],
    failure: float,
    dt: float,
    claims: Sequence[bool],
) -> tuple[bool, str]: ...
def _panic(place: str, simulation: Simulation | None = None) -> None: ...
@final
class Scenario:
    def __new__(cls, **tables: Any) -> Scenario: ...
    @staticmethod
    def from_dict(mapping: Mapping[str, Any], folder: _Path | None = None) -> Scenario: ...
    @staticmethod
    def from_text(text: str, name: str = "<text>", folder: _Path | None = None) -> Scenario: ...
    @staticmethod
    def from_file(path: _Path) -> Scenario: ...
    @staticmethod
    def template(name: str) -> Scenario: ...
    @staticmethod
    def templates() -> list[str]: ...
    @property
    def text(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def title(self) -> str: ...
    def to_dict(self) -> dict[str, Any]: ...
    def with_settings(self, settings: Mapping[str, Any]) -> Scenario: ...
    def simulation(
        self, threads: int | None = None, progress: _Progress = None, bond_law: Law | None = None, contact_law: Law | None = None
    ) -> Simulation: ...
    def pack(self, threads: int | None = None, progress: _Progress = None) -> _types.Packing: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, tuple[str, str, str]]: ...

@final
class Simulation:
    @staticmethod
    def load(
        path: _Path,
        scenario: Scenario | None = None,
        threads: int | None = None,
        bond_law: Law | None = None,
        contact_law: Law | None = None,
    ) -> Simulation: ...
    def save(self, path: _Path) -> str: ...
    def run(self, progress: _Progress = None) -> str | None: ...
    def step(self, count: int = 1, progress: _Progress = None) -> str | None: ...
    @property
    def state(self) -> State: ...
    @property
    def scenario(self) -> Scenario: ...
    @property
    def stopped(self) -> str | None: ...
    @property
    def progress(self) -> float: ...
    @property
    def summary(self) -> _types.Summary: ...
    @property
    def samples(self) -> NDArray[np.void]: ...
    @property
    def operator_samples(self) -> dict[str, NDArray[np.void]]: ...
    @property
    def events(self) -> NDArray[np.void]: ...
    def forces(self) -> _types.Forces: ...
    def bonds(self) -> _types.Bonds: ...
    def set_motion(self, velocity: ArrayLike, angular_velocity: ArrayLike) -> None: ...
    def set_loads(self, force: ArrayLike, moment: ArrayLike | None = None) -> None: ...
    def net_forces(self) -> tuple[_Reals, _Reals]: ...
    @property
    def cell_stress(self) -> _Reals | None: ...
    def state_hash(self) -> str: ...
    def plot(self, x: str | None = None, y: str | None = None, axes: Axes | None = None, **style: Any) -> Axes:
        """Plot one sampled quantity over another with matplotlib; see `concordem.plot`."""

@final
class State:
    @property
    def ids(self) -> NDArray[np.uint32]: ...
    @property
    def positions(self) -> _Reals: ...
    @property
    def temperatures(self) -> _Reals | None: ...
    @property
    def velocities(self) -> _Reals: ...
    @property
    def angular_velocities(self) -> _Reals: ...
    @property
    def orientations(self) -> _Reals: ...
    @property
    def radii(self) -> _Reals: ...
    @property
    def masses(self) -> _Reals: ...
    @property
    def inertias(self) -> _Reals: ...
    @property
    def materials(self) -> NDArray[np.uint16]: ...
    @property
    def clumps(self) -> NDArray[np.uint32]: ...
    @property
    def tags(self) -> NDArray[np.uint64]: ...
    def writable(self, name: Literal["positions", "velocities", "angular_velocities"]) -> _Reals: ...
    @property
    def cell(self) -> _Reals | None: ...
    @property
    def step(self) -> int: ...
    @property
    def time(self) -> float: ...
    @property
    def time_step(self) -> float: ...
    @property
    def bond_count(self) -> int: ...
    def contacts(self) -> dict[str, NDArray[np.void]]: ...
    def __len__(self) -> int: ...

@final
class Result:
    def __new__(cls, path: _Path) -> Result: ...
    @property
    def path(self) -> PathLike[str]: ...
    @property
    def samples(self) -> NDArray[np.void]: ...
    @property
    def events(self) -> NDArray[np.void]: ...
    @property
    def operators(self) -> list[str]: ...
    @property
    def laws(self) -> list[str]: ...
    def table(self, name: str) -> dict[str, NDArray[Any]]: ...
    @property
    def snapshot_times(self) -> _Reals: ...
    @property
    def scenario_text(self) -> str: ...
    @property
    def state_hash(self) -> str: ...
    @property
    def provenance(self) -> dict[str, str]: ...
    def plot(self, x: str | None = None, y: str | None = None, axes: Axes | None = None, **style: Any) -> Axes:
        """Plot one sampled quantity over another with matplotlib; see `concordem.plot`."""

@final
class Region:
    @staticmethod
    def all(volume: float) -> Region: ...
    @staticmethod
    def periodic_cell(edges: ArrayLike) -> Region: ...
    @staticmethod
    def box(low: ArrayLike, high: ArrayLike) -> Region: ...
    @staticmethod
    def sphere(centre: ArrayLike, radius: float) -> Region: ...
    @staticmethod
    def cylinder(centre: ArrayLike, axis: ArrayLike, radius: float, half_length: float) -> Region: ...
    @staticmethod
    def ellipsoid(centre: ArrayLike, axes: ArrayLike) -> Region: ...
    @staticmethod
    def parallelepiped(corner: ArrayLike, edges: ArrayLike) -> Region: ...
    @staticmethod
    def half_spaces(points: ArrayLike, normals: ArrayLike, volume: float) -> Region: ...
    @staticmethod
    def particles(member: ArrayLike, volume: float) -> Region: ...
    @staticmethod
    def grid(low: ArrayLike, high: ArrayLike, count: Sequence[int]) -> list[Region]: ...
    @property
    def volume(self) -> float: ...
    @property
    def centre(self) -> _Reals | None: ...
    def contains(self, point: ArrayLike) -> bool: ...
    def moved(
        self, deformation: ArrayLike, origin: ArrayLike | None = None, displacement: ArrayLike | None = None
    ) -> Region: ...

@final
class Period:
    def __new__(cls, edges: ArrayLike, change: ArrayLike | None = None) -> Period: ...
    @property
    def edges(self) -> _Reals: ...
    @property
    def change(self) -> _Reals: ...

@final
class AffineFit:
    @property
    def centre(self) -> _Reals: ...
    @property
    def translation(self) -> _Reals: ...
    @property
    def gradient(self) -> _Reals: ...
    @property
    def rotation(self) -> _Reals: ...
    @property
    def curvature(self) -> _Reals: ...
    @property
    def strain(self) -> _Reals: ...
    @property
    def cosserat_strain(self) -> _Reals: ...
    @property
    def macro_rotation(self) -> _Reals: ...
    @property
    def micro_rotation(self) -> _Reals: ...
    @property
    def residual(self) -> tuple[float, float]: ...
    @property
    def rotation_residual(self) -> tuple[float, float]: ...
    @property
    def particles(self) -> int: ...
    @property
    def spread(self) -> float: ...
    def displacement(self, points: ArrayLike) -> _Reals: ...
    def rotation_at(self, points: ArrayLike) -> _Reals: ...

@final
class Mesh:
    @property
    def cells(self) -> NDArray[np.uint32]: ...
    @property
    def images(self) -> NDArray[np.int32]: ...
    def __len__(self) -> int: ...

@final
class PowerDiagram:
    @property
    def volumes(self) -> _Reals: ...
    @property
    def face_areas(self) -> _Reals: ...
    @property
    def border_centroids(self) -> _Reals: ...
    @property
    def border_particles(self) -> NDArray[np.uint32]: ...
    def satake_strain(
        self,
        displacement: ArrayLike,
        rotation: ArrayLike | None = None,
        border_displacement: ArrayLike | None = None,
        period: Period | None = None,
    ) -> _types.DualStrain: ...

@final
class Hosted:
    @staticmethod
    def concrete(
        bodies: Mapping[str, Any],
        contacts: Mapping[str, Any],
        laws: Sequence[tuple[int, int, Mapping[str, Any]]],
        materials: int,
        dt: float,
        kinematics: str,
        damping: float = 0.0,
        gravity: ArrayLike | None = None,
        cell: tuple[ArrayLike, ArrayLike, ArrayLike] | None = None,
        threads: int | None = None,
    ) -> Hosted: ...
    @staticmethod
    def of_scenario(
        scenario: Scenario,
        bodies: ArrayLike,
        mass: ArrayLike,
        inertia: ArrayLike,
        dt: float,
        threads: int | None = None,
    ) -> Hosted: ...
    def advance(self, steps: int) -> int: ...
    def attach(self, container: int, forces: int, offsets: Sequence[int]) -> None: ...
    def contact_step(self, dt: float, cell: tuple[ArrayLike, ArrayLike, ArrayLike] | None = None) -> int: ...
    def bodies(self) -> dict[str, Any]: ...
    def contacts(self) -> dict[str, NDArray[np.void]]: ...
    def forces(self, present: bool) -> tuple[_Reals, _types.Contacts]: ...
    def particle_results(self) -> tuple[_Reals, NDArray[np.uint32], _Reals]: ...
    def net_forces(self) -> tuple[_Reals, _Reals]: ...
    @property
    def cell(self) -> tuple[_Reals, _Reals] | None: ...
    @property
    def bond_count(self) -> int: ...
    @property
    def broken(self) -> int: ...
    def losses(self) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]: ...
    @property
    def steps(self) -> int: ...
    @property
    def searches(self) -> int: ...
    def state_hash(self) -> str: ...
    def save(self, path: _Path, text: str) -> str: ...
    def restore(self, path: _Path, losses: ArrayLike, openings: ArrayLike) -> None: ...

def particle_volumes(
    radius: ArrayLike,
    kind: Literal["sphere", "disc"] = "sphere",
    packing_fraction: float | None = None,
) -> _Reals: ...
def particle_moments(
    position: ArrayLike,
    contacts: _ContactsLike,
    loads: _LoadsLike | None = None,
    partition: _Partition = "contact-point",
) -> _Reals: ...
def particle_stress(
    position: ArrayLike,
    contacts: _ContactsLike,
    volumes: ArrayLike,
    loads: _LoadsLike | None = None,
    partition: _Partition = "contact-point",
) -> _Reals: ...
def region_stress(
    position: ArrayLike,
    contacts: _ContactsLike,
    region: Region,
    truncation: _Truncation = "branch-clipped",
    period: Period | None = None,
) -> _types.RegionStress: ...
def region_stress_from_particles(
    position: ArrayLike,
    moments: _Reals,
    region: Region,
    period: Period | None = None,
) -> _Reals: ...
def boundary_stress(count: int, loads: _LoadsLike, volume: float) -> _Reals: ...
def wall_traction(force: ArrayLike, area: float) -> _Reals: ...
def kinetic_stress(
    position: ArrayLike,
    mass: ArrayLike,
    velocity: ArrayLike,
    region: Region,
    period: Period | None = None,
) -> _Reals: ...
def solid_fraction(
    position: ArrayLike,
    volumes: ArrayLike,
    region: Region,
    period: Period | None = None,
) -> float: ...
def axial(tensor: ArrayLike) -> _Reals: ...
def couple_stress_external(
    position: ArrayLike,
    loads: _LoadsLike,
    volume: float,
    centroid: ArrayLike | None = None,
) -> _Reals: ...
def couple_stress_internal(
    position: ArrayLike,
    contacts: _ContactsLike,
    volume: float,
    centroid: ArrayLike | None = None,
) -> _Reals: ...
def resultants(position: ArrayLike, contacts: _ContactsLike) -> tuple[_Reals, _Reals]: ...
def couple_stress_from_resultants(
    position: ArrayLike,
    force: ArrayLike,
    moment: ArrayLike,
    volume: float,
    reference: ArrayLike | None = None,
) -> _Reals: ...
def conjugate_stress(
    position: ArrayLike,
    contacts: _ContactsLike,
    region: Region,
    reference: ArrayLike | None = None,
    period: Period | None = None,
) -> _types.ConjugateStress: ...
def fabric(
    position: ArrayLike,
    contacts: _ContactsLike,
    region: Region,
    truncation: _Truncation = "branch-clipped",
    period: Period | None = None,
) -> _types.Fabric: ...
def coordination(position: ArrayLike, contacts: _ContactsLike) -> _Reals: ...
def damage_tensor(normal: ArrayLike, damage: ArrayLike, exact: bool = False) -> _Reals: ...
def strength_damage(stiffness_damage: float, largest_strain: float, onset_strain: float) -> float: ...
def strength_damage_exponential(largest_strain: float, onset_strain: float, softening_strain: float) -> float: ...
def power(
    position: ArrayLike,
    contacts: _ContactsLike,
    velocity: ArrayLike,
    spin: ArrayLike,
    fit: AffineFit,
    volume: float,
    image_velocity: ArrayLike | None = None,
) -> _types.PowerReport: ...
def coarse_grain(
    position: ArrayLike,
    contacts: _ContactsLike,
    mass: ArrayLike,
    velocity: ArrayLike,
    support: float,
    points: ArrayLike,
    dimension: int = 3,
    period: Period | None = None,
) -> _types.CoarseFields: ...
def affine_stiffness(
    normal: ArrayLike,
    link_volume: ArrayLike,
    normal_modulus: ArrayLike,
    shear_modulus: ArrayLike,
    volume: float,
) -> _Reals: ...
def isotropic_moduli(
    link_volume: float,
    volume: float,
    normal_modulus: float,
    shear_modulus: float,
) -> tuple[float, float]: ...
def voigt_plane(
    contacts: float,
    radius: float,
    area: float,
    normal: float,
    tangential: float,
) -> tuple[float, float]: ...
def affine_forces(
    branch: ArrayLike,
    normal_stiffness: ArrayLike,
    shear_stiffness: ArrayLike,
    gradient: ArrayLike,
) -> _Reals: ...
def moments_about_contact_points(arm: ArrayLike, force: ArrayLike, moment: ArrayLike) -> _Reals: ...
def affine_fit(
    position: ArrayLike,
    displacement: ArrayLike,
    region: Region,
    rotation: ArrayLike | None = None,
    period: Period | None = None,
    dimension: int = 3,
) -> AffineFit: ...
def delaunay(position: ArrayLike, dimension: int = 3, edges: ArrayLike | None = None) -> Mesh: ...
def cell_strain(
    mesh: Mesh,
    position: ArrayLike,
    displacement: ArrayLike,
    period: Period | None = None,
) -> _types.MeshStrain: ...
def bagi_strain(
    mesh: Mesh,
    position: ArrayLike,
    displacement: ArrayLike,
    period: Period | None = None,
) -> _types.DualStrain: ...
def boundary_strain(mesh: Mesh, position: ArrayLike, displacement: ArrayLike) -> _Reals: ...
def cell_gradient(period: Period) -> _Reals: ...
def power_diagram(
    position: ArrayLike,
    radius: ArrayLike,
    low: ArrayLike | None = None,
    high: ArrayLike | None = None,
    edges: ArrayLike | None = None,
    dimension: int = 3,
) -> PowerDiagram: ...
def cosserat_strain(gradient: ArrayLike, rotation: ArrayLike) -> _Reals: ...
def macro_rotation(gradient: ArrayLike) -> _Reals: ...
def particle_strain(
    stress: ArrayLike,
    young: float,
    poisson: float,
    state: Literal["solid", "plane-strain", "plane-stress"] = "solid",
) -> _Reals: ...
def platen_strain(lower: float, upper: float, length: float) -> float: ...
def random_dense(
    count: int,
    radius: float,
    dispersion: float = 0.0,
    friction: float = 0.0,
    seed: int = 1,
    protocol: Literal["jammed", "yade"] = "jammed",
    threads: int | None = None,
    progress: _Progress = None,
) -> _types.Packing: ...
def lattice(kind: str, radius: float, repeats: Sequence[int]) -> _types.Packing: ...
def read_packing(path: _Path, unit: float | None = None) -> _types.Packing: ...
def write_packing(path: _Path, positions: ArrayLike, radii: ArrayLike, cell: ArrayLike | None = None) -> None: ...
def packing_summary(
    positions: ArrayLike,
    radii: ArrayLike,
    cell: ArrayLike | None = None,
    interaction_ratio: float = 1.0,
) -> _types.PackingSummary: ...
def characterise_file(
    file: _Path,
    interaction_ratio: float | None = None,
    coordination: float | None = None,
    cell: Sequence[float] | None = None,
    boundary: float = 2.0,
    page: _Path | None = None,
    threads: int | None = None,
    progress: _Progress = None,
) -> str: ...
def characterise_packing(
    positions: ArrayLike,
    radii: ArrayLike,
    cell: ArrayLike | None = None,
    interaction_ratio: float | None = None,
    coordination: float | None = None,
    boundary: float = 2.0,
    page: _Path | None = None,
) -> str: ...
def spatial_order(positions: ArrayLike, cell: ArrayLike | None = None) -> NDArray[np.uint32]: ...
def hosted_text(path: _Path) -> str: ...
def memory_gather(
    addresses: NDArray[np.uint64],
    offset: int,
    kind: str = "f64",
    components: int = 1,
) -> NDArray[Any]: ...
def memory_scatter(addresses: NDArray[np.uint64], offset: int, values: _Reals) -> None: ...
def memory_scatter_i32(addresses: NDArray[np.uint64], offset: int, values: NDArray[np.int32]) -> None: ...
def memory_targets(address: int) -> NDArray[np.uint64]: ...
def elastic_constants(
    scenario: Scenario,
    dynamics: bool = False,
    residual: float | None = None,
    threads: int | None = None,
    progress: _Progress = None,
) -> _types.ElasticAnswers: ...
def calibrate_elastic(
    scenario: Scenario | None,
    young: float,
    poisson: float,
    law: str | None = None,
    deformable: bool = False,
    particle_poisson: float | None = None,
    particle_softness: float | None = None,
    threads: int | None = None,
    progress: _Progress = None,
) -> _types.ElasticFit: ...
def calibrate_cohesive_beam(
    young: float,
    poisson: float,
    density: float,
    tensile_strength: float | None = None,
    beam_poisson: float = 0.3,
    coordination: float = 6.2,
    dispersion: float = 0.25,
    count: int = 5000,
    seed: int = 1,
    threads: int | None = None,
    progress: _Progress = None,
) -> _types.BeamFit: ...

@final
class DamagePlastic:
    def __new__(
        cls,
        young: float,
        poisson: float,
        compressive_strength: float,
        tensile_strength: float,
        fracture_energy: float,
        *,
        eccentricity: float = 0.525,
        initial_hardening: float = 0.1,
        confined_ductility: float = 0.08,
        compressive_ductility: float = 0.003,
        ductility_pressure: float = 2.0,
        tensile_ductility: float = 1e-6,
        dilation: float = ...,
        softening_ductility: float = 15.0,
    ) -> DamagePlastic: ...
    def update(
        self, strain: ArrayLike, state: ArrayLike, size: ArrayLike, tangent: bool = True
    ) -> _types.PointUpdate: ...
    def hand_over(self, stress: ArrayLike, damage: ArrayLike, size: ArrayLike) -> _Reals: ...
    def damage(self, variable: float, size: float) -> float: ...
    def damage_variable(self, damage: float, size: float) -> float: ...
    @property
    def parameters(self) -> dict[str, float]: ...
    @property
    def largest_size(self) -> float: ...

def handover_tensor(normal: ArrayLike, damage: ArrayLike, formulas: _Formulas = "printed") -> _Reals: ...
def handover_damage(tensor: ArrayLike, formulas: _Formulas = "printed") -> _Reals: ...
@final
class CellStates: ...

@final
class RepresentativeCells:
    def __new__(
        cls, scenario: Scenario, count: int = 1, threads: int | None = None, progress: _Progress = None
    ) -> RepresentativeCells: ...
    def deform(self, gradient: ArrayLike, steps: int = 1) -> None: ...
    def response(self, formulas: _Formulas = "printed") -> _types.CellResponse: ...
    def stiffness(self) -> _Reals: ...
    @property
    def deformation_gradient(self) -> _Reals: ...
    @property
    def time_step(self) -> float: ...
    @property
    def density(self) -> _Reals: ...
    def state_hashes(self) -> list[str]: ...
    def save(self) -> CellStates: ...
    def restore(self, states: CellStates) -> None: ...
    def __len__(self) -> int: ...
