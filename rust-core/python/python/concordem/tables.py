"""The tables of a scenario as typed dictionaries: editors complete their keys and find mistakes in them before a run.

>>> from concordem import Scenario, tables
>>> glass = tables.Material(name="glass", density="2500 kg/m^3", hertz_mindlin=tables.HertzMindlin(young="1 GPa", poisson=0.2))
>>> scenario = Scenario(
...     packing=tables.PackingSpheres(kind="spheres", spheres=[[0, 0, 0, "1 mm"]]),
...     material=glass, contacts={"law": "hertz_mindlin"}, stop={"steps": 1})
>>> Scenario.from_text(scenario.text).to_dict() == scenario.to_dict()
True

At run time they are dictionaries: `Scenario` checks keys and values. Written by docs/book/generate_reference.py --write from the schema that
the program reads scenarios by; changes are lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import Any, Literal, Required, TypeAlias, TypedDict

import numpy as np
from numpy.typing import NDArray

#: A number in SI units, or a text with a unit: `30e9` or `"30 GPa"`.
Quantity: TypeAlias = float | str | np.number[Any]
_Path: TypeAlias = str | PathLike[str]


class AggregateGroup(TypedDict, total=False):
    """Aggregates of one kind, or pores."""

    component: str | None
    """Name of the component of the mix whose volume the grading has. Example: `component = "coarse aggregate"`."""
    depth: Quantity
    """A particle is inside if its center is at least this many of its radii below the surface; default: 0, which conserves the volume fraction.
    0.5 in Stránský 2018. Range: ≥ 0, ≤ 10."""
    first_step: Quantity | None
    """Sizes by the rule of Stránský 2018 instead of an amount, m: the second size is larger than the smallest by this step, each further step has
    the same volume over mass, and the number of spheres follows. Example: `first_step = "5.475 um"`. Range: > 0."""
    grading: GradingTable | None
    """Sizes. Required unless `spheres` is given."""
    material: str | None
    """Name of the material of the particles inside. Required unless `remove_particles` is given. Bonds within an aggregate have the parameters of
    this material, so aggregates can break."""
    remove_particles: bool
    """Whether the group are pores: the packing loses the particles inside, and the others are numbered without gaps; default: false."""
    shape: AggregateShape | None
    """Shape; default: spheres (discs in two dimensions). Example: `shape = { kind = "ellipsoid", elongation = 1.4, flatness = 0.7 }`."""
    smallest: Quantity | None
    """Smallest size that is placed, m; finer aggregates belong to the mortar. Required for a "fuller" grading. Default: the first size of the
    grading. Example: `smallest = "4 mm"`. Range: > 0."""
    spheres: Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any] | None
    """Spheres in given places instead of a grading, one `[x, y, z, radius]` each, m. Where two overlap, the first one counts. Example: `spheres =
    [[0, 0, 0, "8 mm"]]`."""
    volume_fraction: Quantity | None
    """Volume of the grading divided by that of the specimen (in two dimensions, areas), with the part finer than `smallest`, which is not placed.
    Or give `component` or `first_step`. Example: `volume_fraction = 0.4`. Range: > 0, < 1."""


class AggregateShapeSphere(TypedDict, total=False):
    """Spheres; discs in two dimensions."""

    kind: Required[Literal["sphere"]]


class AggregateShapeEllipsoid(TypedDict, total=False):
    """Ellipsoids; ellipses in two dimensions."""

    elongation: Quantity
    """Longest width divided by the middle one; default: 1. Range: ≥ 1, ≤ 10."""
    flatness: Quantity
    """Shortest width divided by the middle one; default: 1. Only in three dimensions. Range: ≥ 0.1, ≤ 1."""
    kind: Required[Literal["ellipsoid"]]


class AggregateShapePolyhedron(TypedDict, total=False):
    """Convex polyhedra, each one the hull of random points of an ellipsoid."""

    corners: int | np.integer[Any]
    """Number of points; default: 12. Range: ≥ 6, ≤ 60."""
    elongation: Quantity
    """Longest width of the ellipsoid divided by the middle one; default: 1. Range: ≥ 1, ≤ 10."""
    flatness: Quantity
    """Shortest width of the ellipsoid divided by the middle one; default: 1. Range: ≥ 0.1, ≤ 1."""
    kind: Required[Literal["polyhedron"]]


class AggregateShapeMesh(TypedDict, total=False):
    """A closed triangulated surface, scaled to each size: the middle one of its three widths along the axes of the file. Two of them keep their
    distance by their convex hulls."""

    kind: Required[Literal["mesh"]]
    path: Required[_Path]
    """Path of the STL file, relative to the scenario. Required. Example: `path = "stone.stl"`."""


class Aggregates(TypedDict, total=False):
    """Aggregates and pores. They divide the particles of the packing by their initial positions: those inside an aggregate have its material and
    its number, those inside a pore are removed, all others belong to the mortar and have the first material."""

    attempts: int | np.integer[Any]
    """Number of places tried for each aggregate, the largest first, before the placing fails; default: 10000. Range: ≥ 1."""
    clearance: Quantity
    """Smallest distance of two aggregates (or pores), divided by the mean of their sizes; default: 0.05. At least `gap`. Range: ≥ 0, ≤ 10."""
    gap: Quantity
    """Smallest distance of two aggregates (or pores), m; default: 0. Range: ≥ 0."""
    group: Required[Sequence[AggregateGroup]]
    """Groups of aggregates or pores; at least one is required."""
    mix: Mix | None
    """Mix design, from which groups take their volume fraction; default: groups give it."""
    seed: int | np.integer[Any]
    """Seed of the random shapes and places; default: 0. The same seed gives the same aggregates, bit by bit. Range: ≥ 0."""
    surface: Surface | None
    """What the surface of the specimen is; default: "mould". A periodic packing has none, and its aggregates are periodic."""
    wall_gap: Quantity
    """Smallest distance from the mould, m; default: 0. Range: ≥ 0."""


class AppliedForce(TypedDict, total=False):
    """A force on each particle of a set."""

    acts: PointOfAction
    """Point of action of the force on deformable particles; default: "body". Rigid particles ignore it."""
    force: Sequence[Quantity] | NDArray[Any]
    """Force on each particle, N; default: zero. Example: `force = [0, 0, "-10 N"]`."""
    history: str | None
    """Name of a history that multiplies force and moment; default: constant."""
    moment: Sequence[Quantity] | NDArray[Any]
    """Moment on each particle, N·m; default: zero."""
    set: Required[str]
    """Name of the set. Required."""


class Bonding(TypedDict, total=False):
    """Bonds made during the run between the particles that are near each other at that moment. They start without force, at the present distance.
    It happens once."""

    between: Sequence[str] | NDArray[Any] | None
    """Names of the two materials that are bonded, which may be the same; default: all materials. Example: `between = ["cement", "sand"]`."""
    interaction_ratio: Quantity
    """Two particles are bonded if their center distance is at most this ratio times the sum of their radii; default: 1, particles that touch.
    Range: ≥ 1, ≤ 10."""
    kinetic_energy: Quantity | None
    """Kinetic energy of all particles, J, below which the bonds are made, from `time` on. Example: `kinetic_energy = "1 uJ"`. Range: > 0."""
    stage: str | None
    """Name of the stage at whose end the bonds are made. Required unless `time` or `kinetic_energy` is given."""
    time: Quantity | None
    """Time from which on the bonds are made, s: at once, or as soon as the kinetic energy is small enough. Example: `time = "20 ms"`. Range: ≥ 0."""


class Bonds(TypedDict, total=False):
    """Bonds made at the start."""

    at_start: bool
    """Whether bonds are made at the start; default: true. With false, only `[[bonding]]` makes bonds."""
    coordination: Quantity | None
    """Mean number of bonds per particle, instead of an interaction ratio. It is counted in the periodic packing, before the shape is cut out, and
    in packings between walls ("cooker", "growth") for the particles inside, more than two mean radii away from the walls; the pairs with the
    smallest center distance over sum of radii are bonded. 6.2 in Jebahi et al. 2015. Range: > 0, ≤ 100."""
    face_correction: bool
    """Whether bonds near the faces of a body that is cut from a periodic packing get larger areas, in place of the bonds that the cut removes;
    default: false, where a layer of a quarter of a diameter has no stiffness. For "cpm", and a shape with `keep = "centers"`."""
    interaction_ratio: Quantity
    """Two particles are bonded if their center distance is at most this ratio times the sum of their radii, up to a relative tolerance of 1e-9.
    With 1, only particles that touch are bonded; 1.5 is usual for concrete. Range: ≥ 1, ≤ 10."""
    law: Required[LawName]
    """Law of the bonds."""
    strength_factors: Sequence[Quantity] | NDArray[Any]
    """Factors on the strengths of the bonds of each sphere, in the order of the packing; a bond has the mean of its two spheres. They multiply
    those of `material.strength_scatter`. Default: 1. Example: `strength_factors = [1, 0.8, 1.2]`."""


class Clump(TypedDict, total=False):
    """A rigid body made of several spheres."""

    angular_velocity: Sequence[Quantity] | NDArray[Any] | None
    """Initial angular velocity, rad/s; default: zero."""
    inertia: Sequence[Quantity] | NDArray[Any] | None
    """Principal moments of inertia, kg·m², smallest first; default: those of the spheres."""
    mass: Quantity | None
    """Mass, kg; default: the sum over the spheres, which counts overlaps twice. Range: > 0."""
    material: str | None
    """Name of the material of the added spheres; overrides the materials of sets. Default: the material of their sets, else the first material."""
    set: str | None
    """Name of a set of packed particles to join. Required unless `spheres` is given."""
    spheres: Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any] | None
    """Spheres added to the packing, one `[x, y, z, radius]` each, m. Required unless `set` is given."""
    velocity: Sequence[Quantity] | NDArray[Any] | None
    """Initial velocity of the center of mass, m/s; default: the velocity that `[[initial]]` gives to all members, else zero."""


class CohesiveBeam(TypedDict, total=False):
    """Elastic beam between the centers of two particles (Jebahi et al. 2015, section 2.4.1). It breaks at its largest principal stress, in tension
    or shear, or at the mean stress of a particle."""

    bending_term: BendingTerm
    """Bending moment in the stress that `tensile_strength` limits."""
    cohesion: Quantity | None
    """Shear stress at which a beam without normal force breaks, Pa (Potyondy and Cundall 2004). With this key a beam breaks in tension or in
    shear; without it, at its largest principal stress. Range: > 0."""
    friction_angle: Quantity | None
    """Angle of friction in the shear strength, rad; only with `cohesion`. Range: ≥ 0."""
    friction_coefficient: Quantity | None
    """Tangent of the angle of friction in the shear strength; or give `friction_angle`; only with `cohesion`. Default: 0. Range: ≥ 0."""
    hydrostatic_strength: Quantity | None
    """Mean stress of a particle at which all its beams break, Pa; no such failure if left out. Range: > 0."""
    model: BeamModel
    """Deformations that the bond resists."""
    moment_share: Quantity | None
    """Share of bending and twisting moments in the stresses of a beam, from 0 to 1; only with `cohesion`. Default: 1. Range: ≥ 0, ≤ 1."""
    poisson: Quantity
    """Poisson's ratio of the beam. Range: > -1, ≤ 0.5."""
    radius: Quantity | None
    """Radius of the beam, m; or give `radius_ratio`. Range: > 0."""
    radius_ratio: Quantity | None
    """Radius of the beam divided by the radius that `radius_rule` names; or give `radius`. Range: > 0."""
    radius_rule: RadiusRule | None
    """Radius that `radius_ratio` multiplies; only with `radius_ratio`. Default: the mean over all bonded particles."""
    shear_coefficient: Quantity | None
    """Shear coefficient of the section; 0.9 if left out; only with model "timoshenko". Range: > 0."""
    shear_ratio: Quantity | None
    """Tangential stiffness divided by normal stiffness; only with model "dual-spring". Range: ≥ 0."""
    tensile_strength: Quantity | None
    """Largest principal stress on the surface of a beam at which it breaks, Pa, with `cohesion` the largest normal stress; unbreakable if left
    out. Between two materials: the mean, or the only one given. Range: > 0."""
    young: Required[Quantity]
    """Young's modulus of the beam, Pa. Range: > 0."""


class Contacts(TypedDict, total=False):
    """Contacts between particles without a bond, and with walls."""

    exclude: Sequence[Sequence[str] | NDArray[Any]] | NDArray[Any]
    """Pairs of materials that pass through each other: particles do not touch particles and walls of the other material. A name twice: the
    particles and walls of this material among themselves. Bonds are not affected. Default: none. Example: `exclude = [["skin", "skin"],
    ["skin", "body"]]`."""
    law: Required[ContactLawName]
    """Law of the contacts."""


class Convection(TypedDict, total=False):
    """Convection: heat `h (T_o - T)` per area."""

    ambient: Required[Quantity]
    """Temperature of the surroundings, K. Required. Range: ≥ 0."""
    coefficient: Required[Quantity]
    """Coefficient of heat transfer, W/(m²·K). Required. Range: > 0."""


class Cpm(TypedDict, total=False):
    """Concrete particle model (Šmilauer 2010; Stránský 2018, section 2.5)."""

    cohesion: Required[Quantity]
    """Cohesion of the undamaged bond: shear strength without normal stress, Pa. Range: ≥ 0."""
    crack_onset_strain: Required[Quantity]
    """Tensile strain at which damage begins. Range: > 0."""
    damage_law: DamageLaw
    """Form of the softening branch."""
    damage_rate_exponent: Quantity | None
    """Exponent of viscous damage; not in mode `yade-public`. Range: > 0."""
    damage_time: Quantity | None
    """Characteristic time of viscous damage, s; rate independent if left out; not in mode `yade-public`. Range: > 0."""
    fracture_energy: Quantity | None
    """Energy per area that a bond in tension dissipates, whatever its length, J/m^2; or give `relative_ductility`. Only in mode `thesis`. Range: >
    0."""
    friction_angle: Quantity | None
    """Angle of friction; or give `friction_coefficient`. Range: ≥ 0."""
    friction_coefficient: Quantity | None
    """Tangent of the angle of friction; or give `friction_angle`. Range: ≥ 0."""
    isotropic_prestress: Quantity
    """Confinement added to the normal stress of every bond, Pa."""
    mode: CpmFormulation
    """Published form of the model."""
    never_damage: bool
    """Keep bonds undamaged at any strain."""
    omega_threshold: Quantity
    """Damage above which a bond in tension is deleted; 1 keeps all. Range: > 0, ≤ 1."""
    plasticity_rate_exponent: Quantity | None
    """Exponent of viscous plasticity; not in mode `yade-public`. Range: > 0."""
    plasticity_time: Quantity | None
    """Characteristic time of viscous plasticity, s; rate independent if left out; not in mode `yade-public`. Range: > 0."""
    relative_ductility: Quantity | None
    """Softening strain divided by the crack onset strain; or give `fracture_energy`. Range: > 0."""
    relative_soft_stiffness: Quantity | None
    """Hardening modulus beyond `soft_strain`, divided by the normal modulus. Range: ≥ 0, ≤ 1."""
    shear_contribution: Quantity
    """Weight of the shear strain in the equivalent strain that drives damage; not in mode `woo`. Range: ≥ 0."""
    shear_ratio: Required[Quantity]
    """Shear modulus of a bond divided by its normal modulus. Range: ≥ 0."""
    soft_strain: Quantity | None
    """Normal strain (negative) beyond which compression hardens plastically; elastic if left out. Range: < 0."""
    yield_log_speed: Quantity | None
    """Speed of the logarithmic yield surface; not in mode `yade-public`. Range: > 0."""
    yield_surface: YieldSurface | None
    """Yield surface of the shear stress; not in mode `yade-public`."""
    young: Required[Quantity]
    """Normal modulus of a bond, Pa. Range: > 0."""


class Cut(TypedDict, total=False):
    """A notch, a hole, or a crack that exists from the start. Bonds that cross it are not made; particles on its two sides touch by the law of
    `contacts`."""

    remove_particles: bool
    """Whether the packing also loses the particles with their center inside a "box", "sphere", or "cylinder"; default: false. The others are then
    numbered without gaps."""
    shape: Required[CutShape]
    """Shape of the cut. Required. Example: `shape = { kind = "box", minimum = ["-1 mm", "-1 m", 0], maximum = ["1 mm", "1 m", "20 mm"] }`."""


#: A straight line in the plane of `dimension = 2`. A center on the line belongs to its left side.
CutShapeLine = TypedDict(
    "CutShapeLine",
    {
        "from": "Required[Sequence[Quantity] | NDArray[Any]]",
        "kind": 'Required[Literal["line"]]',
        "to": "Required[Sequence[Quantity] | NDArray[Any]]",
    },
    total=False,
)


class CutShapeParallelogram(TypedDict, total=False):
    """A parallelogram without thickness. A center on its plane belongs to the side to which the cross product of the edges points."""

    corner: Required[Sequence[Quantity] | NDArray[Any]]
    """A corner, m. Required."""
    edges: Required[Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any]]
    """The two edges that start at the corner, m. Required. Example: `edges = [["10 mm", 0, 0], [0, 0, "5 mm"]]`."""
    kind: Required[Literal["parallelogram"]]


class CutShapeBox(TypedDict, total=False):
    """A box, also its inside."""

    kind: Required[Literal["box"]]
    maximum: Required[Sequence[Quantity] | NDArray[Any]]
    """Corner with the largest coordinates, m. Required."""
    minimum: Required[Sequence[Quantity] | NDArray[Any]]
    """Corner with the smallest coordinates, m. Required."""


class CutShapeSphere(TypedDict, total=False):
    """A sphere, also its inside; a circle if `dimension = 2`."""

    center: Required[Sequence[Quantity] | NDArray[Any]]
    """Center, m. Required."""
    kind: Required[Literal["sphere"]]
    radius: Required[Quantity]
    """Radius, m. Required. Range: > 0."""


class CutShapeCylinder(TypedDict, total=False):
    """A circular cylinder, also its inside."""

    axis: Axis
    """Direction of the axis; default: "z"."""
    center: Required[Sequence[Quantity] | NDArray[Any]]
    """Middle of the axis, m. Required."""
    kind: Required[Literal["cylinder"]]
    length: Quantity | None
    """Length along the axis, m; default: infinite. Range: > 0."""
    radius: Required[Quantity]
    """Radius, m. Required. Range: > 0."""


class CutShapeFacets(TypedDict, total=False):
    """The triangles of an STL file, without the inside of a closed surface."""

    kind: Required[Literal["facets"]]
    path: Required[_Path]
    """Path of the STL file, relative to the scenario. Required. Example: `path = "crack.stl"`."""
    unit: Quantity
    """Length of one unit of the file, m; default: 1 m. Example for a file in millimeters: `unit = "1 mm"`. Range: > 0."""


class DampedBeam(TypedDict, total=False):
    """Cohesive beam with a dashpot beside each of its springs. It breaks as a cohesive beam does."""

    bending_damping_ratio: Quantity | None
    """Damping ratio in bending. Default: `damping_ratio`. Range: ≥ 0."""
    bending_term: BendingTerm
    """Bending moment in the stress that `tensile_strength` limits."""
    cohesion: Quantity | None
    """Shear stress at which a beam without normal force breaks, Pa (Potyondy and Cundall 2004). With this key a beam breaks in tension or in
    shear; without it, at its largest principal stress. Range: > 0."""
    damping_ratio: Required[Quantity]
    """Damping ratio of a pair that vibrates along its bond, 1 for critical damping; of shear, bending, and twist, too, where their keys are left
    out. Range: ≥ 0."""
    friction_angle: Quantity | None
    """Angle of friction in the shear strength, rad; only with `cohesion`. Range: ≥ 0."""
    friction_coefficient: Quantity | None
    """Tangent of the angle of friction in the shear strength; or give `friction_angle`; only with `cohesion`. Default: 0. Range: ≥ 0."""
    hydrostatic_strength: Quantity | None
    """Mean stress of a particle at which all its beams break, Pa; no such failure if left out. Range: > 0."""
    model: BeamModel
    """Deformations that the bond resists."""
    moment_share: Quantity | None
    """Share of bending and twisting moments in the stresses of a beam, from 0 to 1; only with `cohesion`. Default: 1. Range: ≥ 0, ≤ 1."""
    poisson: Quantity
    """Poisson's ratio of the beam. Range: > -1, ≤ 0.5."""
    radius: Quantity | None
    """Radius of the beam, m; or give `radius_ratio`. Range: > 0."""
    radius_ratio: Quantity | None
    """Radius of the beam divided by the radius that `radius_rule` names; or give `radius`. Range: > 0."""
    radius_rule: RadiusRule | None
    """Radius that `radius_ratio` multiplies; only with `radius_ratio`. Default: the mean over all bonded particles."""
    shear_coefficient: Quantity | None
    """Shear coefficient of the section; 0.9 if left out; only with model "timoshenko". Range: > 0."""
    shear_damping_ratio: Quantity | None
    """Damping ratio in shear. Default: `damping_ratio`. Range: ≥ 0."""
    shear_ratio: Quantity | None
    """Tangential stiffness divided by normal stiffness; only with model "dual-spring". Range: ≥ 0."""
    tensile_strength: Quantity | None
    """Largest principal stress on the surface of a beam at which it breaks, Pa, with `cohesion` the largest normal stress; unbreakable if left
    out. Between two materials: the mean, or the only one given. Range: > 0."""
    twist_damping_ratio: Quantity | None
    """Damping ratio in twist. Default: `damping_ratio`. Range: ≥ 0."""
    young: Required[Quantity]
    """Young's modulus of the beam, Pa. Range: > 0."""


class DampingNone(TypedDict, total=False):
    """No damping."""

    kind: Required[Literal["none"]]


class DampingLocal(TypedDict, total=False):
    """Local damping of each component: reduces a force that acts along the motion and increases one that acts against it (Cundall 1987, as in
    YADE)."""

    coefficient: Required[Quantity]
    """Fraction of the force; 0.1 to 0.3 is usual. Required. Example: `coefficient = 0.3`. Range: ≥ 0, ≤ 1."""
    kind: Required[Literal["local"]]
    rotation: Quantity | None
    """Fraction of the moment; default: the same as `coefficient`. Range: ≥ 0, ≤ 1."""


class DampingNonviscous(TypedDict, total=False):
    """A force against the velocity, proportional to the magnitude of the acting force."""

    coefficient: Required[Quantity]
    """Fraction of the force; 0.1 to 0.3 is usual. Required. Example: `coefficient = 0.3`. Range: ≥ 0, ≤ 1."""
    kind: Required[Literal["nonviscous"]]
    rotation: Quantity | None
    """Fraction of the moment; default: the same as `coefficient`. Range: ≥ 0, ≤ 1."""


class DampingTchamwaWielgosz(TypedDict, total=False):
    """Numerical dissipation of the highest frequencies by the integrator, which overweights the acceleration in the new position (Tchamwa and
    Wielgosz 1999)."""

    form: DampingForm
    """Term that the weight multiplies; default: "tchamwa-wielgosz"."""
    kind: Required[Literal["tchamwa-wielgosz"]]
    phi: Quantity
    """Weight of the acceleration; default: 1.3, as in Jebahi et al. 2015. A weight of 1 dissipates nothing. Range: ≥ 1, ≤ 2."""


class Deformable(TypedDict, total=False):
    """Options of deformable particles."""

    condition: Condition | None
    """Relation between the strains and stresses of a particle; default: "plane-strain" in two dimensions, "solid" in three."""
    dashpots: bool
    """Whether dashpot forces strain the particles, too."""
    maximum_iterations: int | np.integer[Any] | None
    """Number of iterations after which the run fails, with update "iterated"; default: 200. Range: ≥ 1."""
    relaxation: Quantity | None
    """Fraction of the change that each iteration applies, with update "iterated"; default: 1. Range: > 0, ≤ 1."""
    tolerance: Quantity | None
    """Largest relative change in the last iteration, with update "iterated"; default: 1e-10. Range: > 0, < 1."""
    update: DeformableUpdate
    """When the strains of a step are computed; default: "lagged"."""


class Factors(TypedDict, total=False):
    """Factors on the parameters of a material, for the bonds and contacts of an interface: weaker and softer than the mortar, for example
    (Stránský 2018, section 8.1)."""

    ductility: Quantity
    """Factor on the ductility: on the softening strain divided by the crack onset strain. Only for laws that soften ("cpm", "softening_beam": on
    the fracture energies). Range: > 0."""
    stiffness: Quantity
    """Factor on the stiffness in all directions; also that of contacts without a bond. Range: > 0."""
    strength: Quantity
    """Factor on the strength: on all stresses or forces at which a bond fails. Range: > 0."""


class FiberGroup(TypedDict, total=False):
    """Fibers of one kind."""

    count: int | np.integer[Any] | None
    """Number of fibers. Example: `count = 40`. Range: ≥ 1."""
    diameter: Required[Quantity]
    """Diameter of the spheres, m. Required. Example: `diameter = "0.5 mm"`. Range: > 0."""
    direction: Sequence[Quantity] | NDArray[Any] | None
    """Direction of all fibers, of any length above 0; default: random, uniform over all directions. Example: `direction = [1, 0, 0]`."""
    length: Quantity | None
    """Length from end to end, m, at least two diameters. Required unless `lines` is given. Example: `length = "12 mm"`. Range: > 0."""
    lines: Sequence[Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any]] | NDArray[Any] | None
    """Fibers in given places instead of random ones, one `[[x, y, z], [x, y, z]]` with the two ends each, m. They may leave the specimen. Example:
    `lines = [[["-10 mm", 0, 0], ["10 mm", 0, 0]]]`."""
    material: Required[str]
    """Name of the material of the fibers, which nothing else has. Required. Its table `cohesive_beam` gives their stiffness and strength; there,
    `radius_ratio` refers to the radius of the fibers, so 1 is a cylinder with their diameter."""
    volume_fraction: Quantity | None
    """Volume of the fibers, as cylinders, divided by that of the specimen. Or give `count` or `lines`. Example: `volume_fraction = 0.01`. Range: >
    0, < 1."""


class Fibers(TypedDict, total=False):
    """Straight fibers: chains of touching spheres, joined by bonds of the law "cohesive_beam". They are added to the packing, between its
    aggregates, and bonded to its particles with the law of `[bonds]`, by the parameters of the two materials or their `[[interface]]`.
    Particles of the packing that are too near are removed."""

    attempts: int | np.integer[Any]
    """Number of places tried for each fiber before the placing fails; default: 10000. Range: ≥ 1."""
    clearing: Quantity
    """Particles of the packing are removed if their center is nearer to that of a sphere of a fiber than this times the sum of both radii;
    default: 0.5. The others may overlap the fiber: bonds begin without force at any distance. 1 removes all that overlap. Range: ≥ 0.2, ≤ 1."""
    gap: Quantity
    """Smallest distance of a fiber from other fibers and from aggregates and pores, m; default: 0. Range: ≥ 0."""
    group: Required[Sequence[FiberGroup]]
    """Groups of fibers; at least one is required."""
    seed: int | np.integer[Any]
    """Seed of the random places; default: 0. The same seed gives the same fibers, bit by bit. Range: ≥ 0."""
    surface: Surface | None
    """What the surface of the specimen is; default: "mould", or that of `[aggregates]`. A periodic packing has none."""
    wall_gap: Quantity
    """Smallest distance from the mould, m; default: 0. Range: ≥ 0."""


class Frictional(TypedDict, total=False):
    """Linear elastic contact with Coulomb friction; no tension."""

    damping_ratio: Quantity
    """Dashpots as a fraction of critical damping. Range: ≥ 0."""
    friction_coefficient: Quantity
    """Friction coefficient (tangent of the angle). Range: ≥ 0."""
    normal_stiffness: Quantity | None
    """Normal stiffness, N/m. Range: > 0."""
    shear_stiffness: Quantity | None
    """Shear stiffness, N/m. Range: ≥ 0."""
    stiffness_ratio: Quantity | None
    """Shear stiffness divided by normal stiffness; with `young`. Range: ≥ 0."""
    young: Quantity | None
    """Modulus, Pa: the normal stiffness of two equal spheres is modulus × radius; or give both stiffnesses. Range: > 0."""


class GradingTableSieves(TypedDict, total=False):
    """A sieve curve. Between two sieves the passing mass is linear in the logarithm of the size."""

    kind: Required[Literal["sieves"]]
    passing: Required[Sequence[Quantity] | NDArray[Any]]
    """Fraction of the mass that passes each sieve, ascending to 1. Required. Example: `passing = [0, 0.4, 1]`."""
    sizes: Required[Sequence[Quantity] | NDArray[Any]]
    """Openings of the sieves, m, ascending. Required. Example: `sizes = ["4 mm", "8 mm", "16 mm"]`."""


class GradingTableFuller(TypedDict, total=False):
    """The curve of Fuller and Thompson (1907): the fraction (size/largest)^exponent of the mass passes."""

    exponent: Quantity
    """Exponent; default: 0.5. Range: > 0, ≤ 10."""
    kind: Required[Literal["fuller"]]
    largest: Required[Quantity]
    """Largest size, m. Required. Example: `largest = "16 mm"`. Range: > 0."""


class GradingTableStransky(TypedDict, total=False):
    """Aggregates of 4.75 mm and more of the concretes in Stránský 2018, table 8.1."""

    kind: Required[Literal["stransky"]]
    largest: Required[Quantity]
    """Largest size, m: 9.5, 12.5, or 19 mm. Required. Example: `largest = "12.5 mm"`. Range: > 0."""


class GradingTableSingle(TypedDict, total=False):
    """One size."""

    kind: Required[Literal["single"]]
    size: Required[Quantity]
    """Size, m. Required. Example: `size = "8 mm"`. Range: > 0."""


class Heat(TypedDict, total=False):
    """Heat conduction, and thermal expansion of bonds. Every material needs a table `thermal`."""

    boundary: Sequence[HeatBoundary]
    """Prescribed temperatures and exchange with the surroundings; default: none, the body is insulated."""
    contact: HeatContact | None
    """Heat between particles that touch at the time: those that come together later, and those at a crack that closes; default: none, heat flows
    only between neighbors at the start. Required with the model "contacts". It needs a law in `[contacts]`, and exactly one of `resistance` and
    `constriction`. Example: `contact = { resistance = "1e-5 m^2*K/W" }`."""
    contact_ratio: Quantity | None
    """Two particles are in contact if their center distance is at most this ratio times the sum of their radii, with pairs "contacts"; default: 1.
    Example: `contact_ratio = 1.01`. Range: ≥ 1, ≤ 2."""
    crack_resistance: Quantity | None
    """Thermal resistance of the crack where a bond broke, m²·K/W; default: cracks insulate. Example: `crack_resistance = 1e-4`. Range: ≥ 0."""
    dissipation: bool
    """Whether the energy that contacts dissipate by damage, friction, and dashpots heats their two particles, half each (at a wall: its particle);
    default: false."""
    initial: Sequence[HeatInitial]
    """Initial temperatures of sets; default: none. A later one overrides an earlier one."""
    model: HeatNetwork
    """How heat flows between particles; default: "power"."""
    motion: bool
    """Whether particles move; default: true. With false, the run only conducts heat."""
    pairs: HeatPairs | None
    """Pairs that exchange heat, with the models "ordered" and "disordered"; default: "contacts"."""
    reference_temperature: Quantity | None
    """Temperature at which bonds have their length at bonding, K; default: the initial temperature. Range: ≥ 0."""
    scheme: HeatScheme
    """Time integration; default: "explicit"."""
    source: Sequence[HeatSource]
    """Sources of heat; default: none."""
    steady: bool
    """Whether the run starts from the steady state under the sources and boundaries at time zero; default: false. The initial temperatures then
    matter only as the reference temperature."""
    temperature: Required[Quantity]
    """Initial temperature, K. Required. Example: `temperature = "293 K"`. Range: ≥ 0."""
    time_factor: Quantity
    """Thermal time that passes in one second of the time of the run; default: 1. Times and velocities in the tables `[[heat.source]]` and
    `[[heat.boundary]]`, and the histories that they name, are in thermal time. Example: `time_factor = 1e4`. Range: > 0."""


class HeatBoundary(TypedDict, total=False):
    """A prescribed temperature, or exchange with the surroundings. It needs exactly one of `temperature`, `flux`, `convection`, and `radiation`."""

    convection: Convection | None
    """Convection. Example: `convection = { coefficient = "500 W/m^2/K", ambient = "293 K" }`."""
    face: str | None
    """Face of the body: "x minimum", "x maximum", "y minimum", ..., "side" of a cylinder, or "all"; default: "all", or with `set` and
    `temperature`: none."""
    flux: Quantity | None
    """Heat into the body per area, W/m². Example: `flux = "2 kW/m^2"`."""
    history: str | None
    """Name of a history that multiplies the temperature (of the surface, or of the surroundings) or the flux; default: constant."""
    radiation: Radiation | None
    """Radiation. Example: `radiation = { emissivity = 0.8, ambient = "293 K" }`."""
    set: str | None
    """Name of a set: only its particles. With `temperature` and without `face`, the particles themselves have this temperature."""
    temperature: Quantity | None
    """Temperature of the surface, K. Example: `temperature = "798 K"`. Range: ≥ 0."""
    wall: str | None
    """Name of a wall: heat flows between the wall and the particles that touch it at the time, through an area of 4 R² each (in two dimensions 2
    R). With `temperature` it is conducted; with `convection` the coefficient is that of the contact, and the ambient temperature that of the
    wall. Not with `face` or `set`. Example: `wall = "floor"`."""


class HeatContact(TypedDict, total=False):
    """Heat between particles that touch at the time, with exactly one of `resistance` and `constriction`."""

    constriction: bool
    """Whether heat flows through the circle of a Hertzian contact, which grows with the overlap, 2 λ a; default: false."""
    resistance: Quantity | None
    """Thermal resistance of a contact, m²·K/W; 0 for none. Its area is 4 R_A R_B (in two dimensions 2 √(R_A R_B)); at a crack it is that of the
    link. Example: `resistance = "1e-5 m^2*K/W"`. Range: ≥ 0."""


class HeatInitial(TypedDict, total=False):
    """Initial temperature of the particles of a set."""

    set: Required[str]
    """Name of the set. Required."""
    temperature: Required[Quantity]
    """Initial temperature, K. Required. Range: ≥ 0."""


class HeatSource(TypedDict, total=False):
    """A source of heat: of a set, or a spot."""

    density: Quantity | None
    """Power per volume of a set, W/m³. Required unless `power` is given. Example: `density = "1 W/mm^3"`."""
    history: str | None
    """Name of a history that multiplies the power; default: constant."""
    power: Quantity | None
    """Power that the body takes up, W. Required unless `density` is given. Example: `power = "20 W"`."""
    set: str | None
    """Name of the set that is heated uniformly. Required unless `spot` is given."""
    spot: HeatSpot | None
    """A spot that may move. Required unless `set` is given. Example: `spot = { center = [0, 0, "5 mm"], radius = "1 mm", velocity = ["3 mm/s", 0,
    0] }`."""


class HeatSpot(TypedDict, total=False):
    """A spot that heats the particles in proportion to `V exp(-|x - x_s|²/(2 r²))`, with `x_s = center + velocity t`."""

    center: Required[Sequence[Quantity] | NDArray[Any]]
    """Center at the start, m. Required."""
    radius: Required[Quantity]
    """Standard deviation r, m. Required. Range: > 0."""
    velocity: Sequence[Quantity] | NDArray[Any]
    """Velocity in thermal time, m/s; default: zero."""


class HertzMindlin(TypedDict, total=False):
    """Hertz contact with Mindlin's shear stiffness, Coulomb friction, and restitution."""

    friction_coefficient: Quantity
    """Friction coefficient (tangent of the angle). Range: ≥ 0."""
    poisson: Required[Quantity]
    """Poisson's ratio of the particles. Range: > -1, ≤ 0.5."""
    restitution: Quantity
    """Coefficient of restitution. At 0 the contact may pull while the spheres separate, so that they stay together. Range: ≥ 0, ≤ 1."""
    shear_damping_ratio: Quantity
    """Shear dashpot as a fraction of critical damping. Range: ≥ 0."""
    young: Required[Quantity]
    """Young's modulus of the particles, Pa. Range: > 0."""


class History(TypedDict, total=False):
    """A factor that changes with time. Motions, forces, walls, and stages name it in their key `history`; it multiplies what they give."""

    name: Required[str]
    """Name of the history. Required. Example: `name = "up and down"`."""
    shape: Required[HistoryShape]
    """The factor over time. Required. Example: `shape = { kind = "table", points = [["0 ms", 0], ["1 ms", 1], ["2 ms", 0]] }`."""


class HistoryShapeTable(TypedDict, total=False):
    """Points in time, with straight lines between them. Before the first and after the last point the factor is constant."""

    kind: Required[Literal["table"]]
    points: Required[Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any]]
    """Times (s) and factors; times must increase. Required. Example: `points = [["0 ms", 0], ["1 ms", 1]]`."""
    repeat: bool
    """Whether the table begins again after its last point; default: false."""
    smooth: bool
    """Whether polynomials of fifth degree, without velocity and acceleration at the points, replace the straight lines; default: false."""


class HistoryShapeSine(TypedDict, total=False):
    """`mean + amplitude sin(2 pi t/period + phase)`."""

    amplitude: Quantity
    """Amplitude; default: 1."""
    kind: Required[Literal["sine"]]
    mean: Quantity
    """Mean; default: 0."""
    period: Required[Quantity]
    """Period, s. Required. Example: `period = "2 ms"`. Range: > 0."""
    phase: Quantity
    """Phase at time zero, rad; default: 0. Example: `phase = "90 deg"`."""


class HistoryShapeExpression(TypedDict, total=False):
    """A formula of the time `t` in seconds, with `+ - * / ^`, parentheses, `pi`, and functions such as `sin`, `exp`, `sqrt`, `min`."""

    expression: Required[str]
    """The formula. Required. Example: `expression = "1e-3*sin(2*pi*50*t)"`."""
    kind: Required[Literal["expression"]]
    until: Quantity | None
    """Time up to which the largest value and the steepest slope of the formula are searched, on which the time step depends, s; default:
    `stop.time`. The formula holds after it, too. Example: `until = "20 ms"`. Range: > 0."""


class Initial(TypedDict, total=False):
    """Initial velocity of the particles of a set."""

    angular_velocity: Sequence[Quantity] | NDArray[Any]
    """Initial angular velocity, rad/s; default: zero."""
    set: Required[str]
    """Name of the set. Required."""
    velocity: Sequence[Quantity] | NDArray[Any]
    """Initial velocity, m/s; default: zero. Example: `velocity = ["1 m/s", 0, 0]`."""


class Integration(TypedDict, total=False):
    """Time integration."""

    allow_energy_error: bool
    """Continue even if integration errors have changed the energy by more than 5 %, or the motion is unstable; default: false, which ends the run
    with an error. `allow_unstable` implies it."""
    allow_unstable: bool
    """Run even if the time step exceeds the stability bound, at the start or later, or the strains of deformable particles do not converge;
    default: false."""
    contact_safety: Quantity | None
    """Largest fraction of the stability bound of a single contact that the time step "auto" uses, for every pair of materials that can touch and
    every wall. Default: 0.1 without bonds, which keeps the energy of an elastic impact within 1 %; 0.5 with bonds, where most contacts form
    only after failure. Range: > 0, ≤ 1."""
    damping: Damping
    """Numerical damping; default: none. Example: `damping = { kind = "local", coefficient = 0.3 }`."""
    gravity: Sequence[Quantity] | NDArray[Any]
    """Gravitational acceleration, m/s²; default: zero. Example: `gravity = [0, 0, -9.81]`."""
    safety: Quantity
    """Fraction of the stability bound that the time step "auto" uses; default: 0.8. Range: > 0, ≤ 1."""
    scheme: Scheme
    """Integration scheme; default: "leapfrog"."""
    time_step: Quantity
    """Time step, s; default: "auto", the tightest stability bound times `safety`. Example: `time_step = "0.2 us"`. Range: > 0."""


class Interface(TypedDict, total=False):
    """Parameters between two materials, instead of the mean of both."""

    between: Required[Sequence[str] | NDArray[Any]]
    """Names of the two materials. With `[aggregates]`, the name of the same material twice: bonds between two of its aggregates."""
    cohesive_beam: CohesiveBeam | None
    """Parameters of the cohesive beam."""
    cpm: Cpm | None
    """Parameters of the concrete particle model."""
    damped_beam: DampedBeam | None
    """Parameters of the damped beam."""
    factors: Factors | None
    """Factors on the parameters of the material `of`; default: all are 1. Example: `factors = { stiffness = 0.5, strength = 0.5, ductility = 0.1
    }`."""
    frictional: Frictional | None
    """Parameters of the linear frictional contact."""
    hertz_mindlin: HertzMindlin | None
    """Parameters of the Hertz-Mindlin contact."""
    jointed: Jointed | None
    """Parameters of the jointed cohesive frictional model."""
    linear_bond: LinearBond | None
    """Parameters of the linear bond."""
    of: str | None
    """Material whose parameters the interface takes, times the `factors`, for the laws that have no table here; default: the mean of both
    materials. Example: `of = "mortar"`."""
    softening_beam: SofteningBeam | None
    """Parameters of the softening beam."""


class Joint(TypedDict, total=False):
    """A joint of rock, or a set of parallel ones: bonds and contacts between particles on its two sides are smooth joints, which slide along it
    whatever the directions between the particles. Stiffnesses and strengths act on the areas of the bonds, π times the smaller radius squared,
    which may add up to more than the plane. Needs the law "jointed" for bonds and contacts."""

    cohesion: Quantity
    """Shear strength without normal force, Pa; default: 0. Without both strengths the joint is open from the start, and its two faces only press
    and slide. In YADE: `jointCohesion`. Range: ≥ 0."""
    dilation_angle: Quantity
    """Angle at which the faces climb while they slide, rad; default: 0. At most the angle of friction. In YADE: `jointDilationAngle`. Range: ≥ 0."""
    friction_angle: Quantity | None
    """Angle of friction, rad. In YADE: `jointFrictionAngle`. Range: ≥ 0."""
    friction_coefficient: Quantity | None
    """Tangent of the angle of friction; or give `friction_angle`. Range: ≥ 0."""
    normal_stiffness: Required[Quantity]
    """Normal stiffness per area, Pa/m. Required. In YADE: `jointNormalStiffness`. Example: `normal_stiffness = "100 GPa/m"`. Range: > 0."""
    shape: Required[JointShape]
    """Where the joint lies at the start. Required. Example: `shape = { kind = "plane", point = [0, 0, 0], normal = [0, 1, 1] }`."""
    shear_stiffness: Required[Quantity]
    """Shear stiffness per area, Pa/m. Required. In YADE: `jointShearStiffness`. Range: > 0."""
    tensile_strength: Quantity
    """Tensile strength, Pa; default: 0, none of its own: then the friction cone ends the bonds, at cohesion / friction coefficient. In YADE:
    `jointTensileStrength`. Range: ≥ 0."""


class JointShapePlane(TypedDict, total=False):
    """An infinite plane, or several parallel ones."""

    count: int | np.integer[Any]
    """Number of planes; default: 1. Range: ≥ 1, ≤ 1,000."""
    dip: Quantity | None
    """Angle between the plane and the horizontal, rad, 0 to 90°; z points up. Example: `dip = "60 deg"`."""
    dip_direction: Quantity | None
    """Horizontal direction in which the plane falls, rad; default: 0, along y. 90° is along x, as on a map whose north is y."""
    kind: Required[Literal["plane"]]
    normal: Sequence[Quantity] | NDArray[Any] | None
    """Normal, of any length; or give `dip`. Example: `normal = [0, 0.5, 1]`."""
    point: Required[Sequence[Quantity] | NDArray[Any]]
    """A point of the plane, of several the first, m. Required."""
    spacing: Quantity | None
    """Distance from one plane to the next, along the normal, m. Required with a `count` above 1. Range: > 0."""


class JointShapeDisc(TypedDict, total=False):
    """A circular disc."""

    center: Required[Sequence[Quantity] | NDArray[Any]]
    """Center, m. Required."""
    dip: Quantity | None
    """Angle between the disc and the horizontal, rad, 0 to 90°; z points up."""
    dip_direction: Quantity | None
    """Horizontal direction in which the disc falls, rad; default: 0, along y. 90° is along x."""
    kind: Required[Literal["disc"]]
    normal: Sequence[Quantity] | NDArray[Any] | None
    """Normal, of any length; or give `dip`."""
    radius: Required[Quantity]
    """Radius, m. Required. Range: > 0."""


class JointShapeFacets(TypedDict, total=False):
    """The triangles of an STL file. Their corners run the same way round, so that all have the front on one side."""

    kind: Required[Literal["facets"]]
    path: Required[_Path]
    """Path of the STL file, relative to the scenario. Required. Example: `path = "joint.stl"`."""
    unit: Quantity
    """Length of one unit of the file, m; default: 1 m. Example for a file in millimeters: `unit = "1 mm"`. Range: > 0."""


class Jointed(TypedDict, total=False):
    """Brittle bond with tensile strength, cohesion, and friction, as in YADE's JCFpm."""

    cohesion: Required[Quantity]
    """Shear strength of a bond without normal force, Pa. Range: ≥ 0."""
    friction_angle: Quantity | None
    """Angle of friction of a bond, rad. In YADE: `frictionAngle`. Range: ≥ 0."""
    friction_coefficient: Quantity | None
    """Tangent of the angle of friction of a bond, whole or cracked in shear; or give `friction_angle`. Range: ≥ 0."""
    residual_friction_angle: Quantity | None
    """Angle of friction of contacts that were no bond, or whose bond is gone, rad. In YADE: `residualFrictionAngle`. Range: ≥ 0."""
    residual_friction_coefficient: Quantity | None
    """Tangent of the angle of friction of contacts that were no bond, or whose bond is gone; or give `residual_friction_angle`. Default: that of
    bonds. Range: ≥ 0."""
    stiffness_ratio: Required[Quantity]
    """Shear stiffness divided by normal stiffness. In YADE: `poisson`. Range: ≥ 0."""
    tensile_strength: Required[Quantity]
    """Tensile strength of a bond, Pa; 0 for none of its own: then the friction cone ends it, at cohesion / friction coefficient. Range: ≥ 0."""
    young: Required[Quantity]
    """Modulus, Pa: the normal stiffness of two equal spheres is modulus × radius. In YADE: `young`. Range: > 0."""


class LinearBond(TypedDict, total=False):
    """Linear elastic bond with dashpots and brittle failure; after failure a contact with Coulomb friction."""

    damping_ratio: Quantity
    """Dashpots as a fraction of critical damping. Range: ≥ 0."""
    friction_coefficient: Quantity
    """Friction coefficient (tangent of the angle) after failure. Range: ≥ 0."""
    normal_stiffness: Required[Quantity]
    """Normal stiffness of a bond, N/m. Range: > 0."""
    normal_strength: Quantity | None
    """Tensile force at which a bond breaks, N; unbreakable if left out. Between two materials: the mean, or the only one given. Range: > 0."""
    shear_stiffness: Required[Quantity]
    """Shear stiffness of a bond, N/m. Range: ≥ 0."""
    shear_strength: Quantity | None
    """Shear force at which a bond breaks, N; unbreakable if left out. Between two materials: the mean, or the only one given. Range: > 0."""
    subtract_initial_gap: bool
    """Whether a bond is unstressed at its length at bonding."""


class LoadingNone(TypedDict, total=False):
    """No loading beyond gravity, walls, forces, and prescribed motions."""

    kind: Required[Literal["none"]]


class LoadingUniaxial(TypedDict, total=False):
    """Two end layers move apart or together at constant velocity; the stress is their mean force divided by the area."""

    area: Quantity | None
    """Cross-section that the stress refers to, m²; default: that of the packing's shape, else of the bounding box. "hull": the smallest of eight
    sections; the area of a section is that of the convex hull of the spheres that its plane cuts. Example: `area = "25 cm^2"`. Range: > 0."""
    axis: Axis
    """Direction of loading; default: "z"."""
    gauge_length: Quantity | None
    """Length that strain and strain rate refer to, m; default: the initial distance of the mean positions of the layers. To compare with a
    published test, give the distance over which it measured. Example: `gauge_length = "47.3 mm"`. Range: > 0."""
    initial_velocity_field: bool
    """Whether the initial velocity varies linearly between the ends, which avoids a shock wave; default: true."""
    kind: Required[Literal["uniaxial"]]
    lateral: Lateral
    """Motion of the end layers across the axis; default: "free"."""
    layer_thickness: Quantity | None
    """Thickness of each end layer, m; default: (1 + 2 interaction ratio) times the largest radius. With that thickness every cross-section outside
    the layers is crossed by as many bonds as one deep inside. Range: > 0."""
    opening: OpeningControl | None
    """Control by the opening of a crack, up to `strain_rate`; default: none, a constant velocity. Example: `opening = { gauge = "crack mouth",
    rate = "1 mm/s", response_time = "50 us" }`."""
    strain_rate: Required[Quantity]
    """Rate of the engineering strain between the ends, 1/s; positive in tension. Required. Example: `strain_rate = "0.4 1/s"`."""


class LoadingBending(TypedDict, total=False):
    """Two end layers rotate rigidly in opposite directions about an axis across the specimen, and move freely along its axis. The stress is that
    in the outer fiber of an elastic beam under the mean of both end moments."""

    about: Required[Axis]
    """Axis about which the ends rotate, each by half of the angle. Required. Example: `about = "y"`."""
    axis: Axis
    """Axis of the specimen; default: "z"."""
    initial_velocity_field: bool
    """Whether the initial velocity is that of uniform curvature, which avoids a shock wave; default: true."""
    kind: Required[Literal["bending"]]
    layer_thickness: Quantity | None
    """Thickness of each end layer, m; default: as for "uniaxial". Range: > 0."""
    rate: Required[Quantity]
    """Rate of change of the angle between the ends, rad/s. Required. Example: `rate = "8 rad/s"`."""


class LoadingTorsion(TypedDict, total=False):
    """Two end layers rotate rigidly in opposite directions about the axis of a cylinder, and move freely along it. The stress is the shear stress
    at the surface of an elastic cylinder under the mean of both end moments."""

    axis: Axis
    """Axis of the specimen; default: "z"."""
    initial_velocity_field: bool
    """Whether the initial velocity is that of uniform twist, which avoids a shock wave; default: true."""
    kind: Required[Literal["torsion"]]
    layer_thickness: Quantity | None
    """Thickness of each end layer, m; default: as for "uniaxial". Range: > 0."""
    rate: Required[Quantity]
    """Rate of change of the angle between the ends, rad/s. Required. Example: `rate = "8 rad/s"`."""


class LoadingCellStrain(TypedDict, total=False):
    """The periodic cell follows a velocity gradient. Particles start with its affine velocity and follow its changes, except in prescribed
    components."""

    kind: Required[Literal["cell-strain"]]
    velocity_gradient: Required[Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any]]
    """Velocity gradient, 1/s: row i, column j is the derivative of velocity component i along axis j. Required. Example: `velocity_gradient = [[0,
    0, 0], [0, 0, 0], [0, 0, 0.4]]`."""


class LoadingCellStress(TypedDict, total=False):
    """A servo deforms the periodic cell until its mean stress reaches a target. Particles follow the cell, except in prescribed components."""

    kind: Required[Literal["cell-stress"]]
    maximum_strain_rate: Required[Quantity]
    """Largest strain rate that the servo may use, 1/s. Required. Choose it well above the strain rates of the specimen. Example:
    `maximum_strain_rate = "1 1/s"`. Range: > 0."""
    strain_rate: Sequence[Quantity] | NDArray[Any]
    """Strain rates of axes that do not follow their stress, 1/s; "free" axes and shear follow it. Default: all free. The stress of such an axis is
    the target of stages with `control = "stress"`; without such a stage it must be 0. Example of a triaxial test: `strain_rate = ["free",
    "free", "-0.1 1/s"]`."""
    stress: Required[Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any]]
    """Target stress, symmetric, tension positive, Pa. Required. Example: `stress = [["-1 MPa", 0, 0], [0, "-1 MPa", 0], [0, 0, "-1 MPa"]]`."""
    tolerance: Quantity
    """Relative error at which the target stress counts as reached; default: 0.005. Range: > 0, ≤ 1."""


class LoadingPlatens(TypedDict, total=False):
    """Two rigid plates press on the ends of the specimen, or strips of particles on a cylinder that splits."""

    area: Quantity | None
    """Cross-section that the stress refers to, m²; default: that of the packing's shape, else of the bounding box. "hull": the smallest of eight
    sections; the area of a section is that of the convex hull of the spheres that its plane cuts. "splitting": the plates split a cylinder that
    lies between them; the stress is the tension `2P/(pi D L)` in its middle, positive. Example: `area = "25 cm^2"`. Range: > 0."""
    axis: Axis
    """Direction of loading; default: "z"."""
    closing_velocity: Required[Quantity]
    """Velocity at which the plates approach each other, m/s. Required. Example: `closing_velocity = "10 mm/s"`. Range: > 0."""
    kind: Required[Literal["platens"]]
    material: str | None
    """Name of the material of the plates. Required unless `strip_width` is given."""
    opening: OpeningControl | None
    """Control by the opening of a crack, up to `closing_velocity`; default: none, a constant velocity. Example: `opening = { gauge = "crack
    mouth", rate = "1 mm/s", response_time = "50 us" }`."""
    strip_width: Quantity | None
    """Width of the two strips of particles, one radius of the largest particle deep, that move along `axis` in place of plates, and freely across
    it, m; for `area = "splitting"`. Plates touch single particles of a rough surface, and crush them. Take a tenth of the diameter, and at
    least five radii. Default: none, plates. Example: `strip_width = "5 mm"`. Range: > 0."""


class LoadingFlexure(TypedDict, total=False):
    """A beam on two supports is bent in three or four points: one or two rollers press on its other side. The stress is that in the outer fiber of
    an elastic beam, `6M/(b h^2)`; the strain that of such a beam with the deflection w under the rollers, `3h w/(a (3l - 4a))` with the
    distance a between support and roller."""

    across: Axis | None
    """Direction in which the supports push; the rollers push against it. Default: "z", in two dimensions "y"; "x" for a beam along that axis."""
    axis: Axis
    """Axis of the beam; default: "x". The packing must be a box."""
    closing_velocity: Required[Quantity]
    """Velocity at which the rollers approach the supports, m/s. Required. Example: `closing_velocity = "10 mm/s"`. Range: > 0."""
    inner_span: Quantity
    """Distance between two rollers, m; default: 0, one roller (three-point bending). Range: ≥ 0."""
    kind: Required[Literal["flexure"]]
    material: str | None
    """Name of the material of supports and rollers. Required with `roller_radius`."""
    opening: OpeningControl | None
    """Control by the opening of a crack, up to `closing_velocity`; default: none, a constant velocity. Example: `opening = { gauge = "crack
    mouth", rate = "1 mm/s", response_time = "50 us" }`."""
    roller_radius: Quantity | None
    """Radius of supports and rollers as cylindrical walls that touch the nearest particle, m. Required unless `strip_width` is given. On a rough
    surface they touch single particles, on which a beam in three dimensions can roll. Range: > 0."""
    span: Required[Quantity]
    """Distance between the supports, m. Required. Example: `span = "100 mm"`. Range: > 0."""
    strip_width: Quantity | None
    """Width of the strips of particles on the surface of the beam that supports and rollers hold and move along `across`; they move freely along
    the other axes, and rotate. m. Required unless `roller_radius` is given. Take two to three radii of the particles: wider strips clamp the
    beam. Range: > 0."""


class Material(TypedDict, total=False):
    """A material."""

    cohesive_beam: CohesiveBeam | None
    """Parameters of the cohesive beam."""
    cpm: Cpm | None
    """Parameters of the concrete particle model."""
    damped_beam: DampedBeam | None
    """Parameters of the damped beam."""
    deformable: ParticleElasticity | None
    """Elastic constants of the particles themselves, which deform under their contacts; rigid if left out."""
    density: Required[Quantity]
    """Mass density of the particles themselves (not of the packing), kg/m³. Range: > 0."""
    frictional: Frictional | None
    """Parameters of the linear frictional contact."""
    hertz_mindlin: HertzMindlin | None
    """Parameters of the Hertz-Mindlin contact."""
    jointed: Jointed | None
    """Parameters of the jointed cohesive frictional model."""
    linear_bond: LinearBond | None
    """Parameters of the linear bond."""
    name: Required[str]
    """Name, by which sets and walls refer to it. Particles that no set assigns to another material have the first one."""
    softening_beam: SofteningBeam | None
    """Parameters of the softening beam."""
    strength_scatter: StrengthScatter | None
    """Scatter of the strengths of bonds; default: none."""
    thermal: Thermal | None
    """Thermal constants. Required with `[heat]`."""


class Membrane(TypedDict, total=False):
    """A flexible membrane, as the rubber around a triaxial specimen: it spans the outer particles by triangles between their centers (in two
    dimensions lines), and presses on them. Each triangle gives a third of its pressure times its present area to each of its corners. The
    triangles are found at the start and move with their particles. One that is drawn out wider than twice its reach presses less, and from four
    times on not at all: its particle has left the body."""

    history: str | None
    """Name of a history that multiplies the pressure; default: constant."""
    open_along: Axis | None
    """Axis at whose two ends the membrane is open, because plates or end layers press there: triangles between particles of the outermost layer,
    one mean diameter thick, are left out. Default: none, the membrane is closed. Example: `open_along = "z"`."""
    pressure: Required[Quantity]
    """Pressure on the specimen, Pa. Required. Example: `pressure = "2 MPa"`. Range: > 0."""
    reach: Quantity | None
    """Largest radius of an empty sphere (disc) through the centers of particles that the membrane leaves inside. Into wider gaps at the surface it
    sinks. Default: 2.5 times the largest radius of a particle. Range: > 0."""


class MeshMotion(TypedDict, total=False):
    """Motion of the vertices of a mesh, over the change `g` of a history's factor since the start: a vertex that starts at `X` is at `c + d g +
    R(X + u g - c)`. `R` rotates by `g` times the rotation vector about the center `c`; `d` is the displacement of all vertices, and `u` that of
    the vertex alone."""

    center: Sequence[Quantity] | NDArray[Any] | None
    """A point on the axis of the rotation, m. Required with `rotation`."""
    displacement: Sequence[Quantity] | NDArray[Any]
    """Displacement of all vertices at the change 1, m; default: zero. Example: `displacement = [0, 0, "-1 mm"]`."""
    history: Required[str]
    """Name of the history. Required. Example: `history = "turn"`."""
    rotation: Sequence[Quantity] | NDArray[Any] | None
    """Rotation vector at the change 1, rad: its direction is the axis, its length the angle; default: zero. Needs `center`."""
    vertices: Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any] | None
    """Displacements of the single vertices at the change 1, m, one row per vertex in the order of the mesh; default: none. They rotate with
    `rotation`. Example: `vertices = [[0, 0, 0], ["1 mm", 0, 0], [0, 0, 0]]`."""


class Mix(TypedDict, total=False):
    """Mix design."""

    air: Quantity | None
    """Volume fraction of air; or give `unit_weight`. Default: 0. Range: ≥ 0, < 1."""
    components: Required[Sequence[MixComponent]]
    """Components of the concrete. Required. Example: `components = [{ name = "water", content = "180 kg/m^3", density = "1000 kg/m^3" }]`."""
    unit_weight: Quantity | None
    """Unit weight of the fresh concrete, from which the volume of air follows, kg/m³; or give `air`. Range: > 0."""


class MixComponent(TypedDict, total=False):
    """Component of a mix."""

    content: Required[Quantity]
    """Mass per volume of concrete, kg/m³. Required. Example: `content = "750 kg/m^3"`. Range: > 0."""
    density: Required[Quantity]
    """Density of the component, kg/m³. Required. Example: `density = "2590 kg/m^3"`. Range: > 0."""
    name: Required[str]
    """Name, to which groups refer. Required."""


class OpeningControl(TypedDict, total=False):
    """The loading moves so that the elongation of a gauge grows at a given rate. It turns back where it must, as with a brittle specimen that
    snaps back: its displacement w follows `dw/dt = gain (r - de/dt) + (r t - e)/T + 0.1/T^2 Integral(r t - e)`, with the elongation e, its rate
    r, and the response time T, up to the velocity or strain rate of the loading. Stages multiply r by their factor."""

    gain: Quantity
    """Displacement of the loading per error of the elongation, at once; default: 0.5. With a larger one the loading follows faster where the
    specimen snaps back, but may swing with waves in it. Range: > 0."""
    gauge: Required[str]
    """Name of a `[[sample]]` with the operator "gauge". Required. Example: `gauge = "crack mouth"`."""
    rate: Required[Quantity]
    """Rate of the elongation of the gauge, m/s; negative if the loading shortens the gauge. Required. Example: `rate = "1 mm/s"`."""
    response_time: Required[Quantity]
    """Time in which the loading makes up for an error of the elongation, s. Take about a quarter of the period of the slowest vibration of the
    specimen: with less, loading and specimen swing. Required. Example: `response_time = "50 us"`. Range: > 0."""


class OperatorSample(TypedDict, total=False):
    """An operator that is evaluated during the run; its records go to `/samples/NAME` of the result."""

    about: Sequence[Quantity] | NDArray[Any] | None
    """Point that the moment of `set-force` refers to, m; default: the mean position of the set. Example: `about = [0, 0, 0]`."""
    area: Quantity | None
    """Area that the traction refers to, m²; required for `wall-traction`. Example: `area = "36 mm^2"`. Range: > 0."""
    grid: Sequence[int | np.integer[Any]] | NDArray[Any] | None
    """Number of cells along x, y, z into which a box is divided; each cell gives its own values. Example: `grid = [4, 4, 8]`."""
    interval: int | np.integer[Any] | None
    """Steps between two evaluations; default: `output.sample_interval`. Example: `interval = 100`. Range: ≥ 1."""
    name: str | None
    """Name in the result; default: the name of the operator. Example: `name = "core stress"`."""
    operator: Required[Operator]
    """Quantity to evaluate. Required. Example: `operator = "region-stress"`."""
    partition: Partition | None
    """Division of the branch vector between the two particles of a contact, for `particle-stress`; default: "contact-point"."""
    region: SampleRegion | None
    """Region to evaluate; default: the periodic cell. Required if there is no cell. Example: `region = { kind = "sphere", center = [0, 0, 0],
    radius = "5 mm" }`."""
    set: str | None
    """Name of the set of particles; required for `set-force` and `set-motion`. Example: `set = "top"`."""
    sets: Sequence[str] | NDArray[Any] | None
    """Names of the two sets between which `gauge` measures. Example: `sets = ["lower mark", "upper mark"]`."""
    truncation: Truncation | None
    """Treatment of contacts that cross the boundary of the region, for `region-stress` and `fabric`; default: "branch-clipped", or "half-crossing"
    for a list of particles."""
    velocity: Sequence[Quantity] | NDArray[Any]
    """Velocity of the region, m/s; default: zero. Example: `velocity = [0, 0, "1 mm/s"]`."""
    velocity_gradient: Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any]
    """Velocity gradient with which the region deforms about its center, 1/s; default: zero. Row i holds the derivatives of the velocity along axis
    i."""
    wall: str | None
    """Name of the wall; required for `wall-traction`. A box has six walls: "NAME x minimum", "NAME x maximum", ..."""


class Output(TypedDict, total=False):
    """Contents and intervals of the output."""

    bond_snapshots: bool
    """Whether snapshots contain the bonds, too: damage, force, and opening of each, which `concordem export` writes as lines for ParaView;
    default: false, because bonds need more space than particles."""
    checkpoint_interval: int | np.integer[Any] | None
    """Steps between two checkpoints, in addition to those written about every minute; default: none. Range: ≥ 1."""
    csv: bool
    """Whether to write the time series as a CSV file, too; default: false."""
    events_damage: Quantity
    """Damage above which a bond enters the event log; default: 0.9. Range: > 0, ≤ 1."""
    file: _Path | None
    """Path of the result file, relative to the scenario; default: the name of the scenario with `.h5`."""
    sample_interval: int | np.integer[Any]
    """Steps between two records of stress, strain, and energies; default: 10. Range: ≥ 1."""
    snapshot_interval: int | np.integer[Any] | None
    """Steps between two snapshots of all particles and contacts; default: only the first and the last state. Range: ≥ 1."""


class PackingRandomDense(TypedDict, total=False):
    """Random dense packing: a periodic cell of spheres is compacted isotropically, then tiled and cropped to the shape."""

    count: Required[int | np.integer[Any]]
    """Number of spheres in the periodic cell. Required. Example: `count = 1000`. Range: ≥ 1, ≤ 100,000,000."""
    friction: Quantity
    """Friction coefficient during compaction; default: 0, which gives the densest packing. A coefficient of 0.5 gives a loose one. Range: ≥ 0."""
    kind: Required[Literal["random-dense"]]
    protocol: Protocol
    """Stopping rule of the compaction; default: "jammed", a packing at rest under a residual pressure. "yade" stops as YADE's compactor does, a
    little looser and not at rest, like the packings of Stránský 2018."""
    radii: Radii | None
    """Distribution of radii. Required unless `radius` is given. Example: `radii = { kind = "uniform", minimum = "0.8 mm", maximum = "1.2 mm" }`."""
    radius: Quantity | None
    """Radius of all spheres, m. Required unless `radii` is given. Example: `radius = "1 mm"`. Range: > 0."""
    seed: int | np.integer[Any]
    """Seed of the random numbers; default: 0. The same seed gives the same packing, bit by bit. Range: ≥ 0."""
    shape: Required[Shape]
    """Shape that is cut out of the packing. Required. Example: `shape = { kind = "box", size = ["15 mm", "15 mm", "30 mm"] }`."""


class PackingRandomDiscs(TypedDict, total=False):
    """Random discs in the plane z = 0: a periodic square of overlapping discs is tiled and cropped to the shape. In three dimensions they are
    spheres with centers in that plane."""

    count: Required[int | np.integer[Any]]
    """Number of discs in the periodic square. Required. Example: `count = 500`. Range: ≥ 1, ≤ 100,000,000."""
    kind: Required[Literal["random-discs"]]
    radii: Radii | None
    """Distribution of radii. Required unless `radius` is given. Example: `radii = { kind = "uniform", minimum = "0.8 mm", maximum = "1.2 mm" }`."""
    radius: Quantity | None
    """Radius of all discs, m. Required unless `radii` is given. Equal discs crystallize. Example: `radius = "1 mm"`. Range: > 0."""
    seed: int | np.integer[Any]
    """Seed of the random numbers; default: 0. The same seed gives the same packing, bit by bit. Range: ≥ 0."""
    shape: Required[Shape]
    """Shape that is cut out of the packing; its size along z is ignored. Required."""
    solid_fraction: Quantity
    """Area of all discs divided by the area of the square; default: 0.932. Discs begin to touch at 0.84 and have a mean of 5.1 contacts at 0.93.
    Range: ≥ 0.1, ≤ 1.1."""


class PackingCooker(TypedDict, total=False):
    """Dense packing between walls: spheres are inserted into a vessel at random, then by force, and relax after each packet; then the walls soften
    (Jebahi et al. 2015, section 2.3.1). No key gives the number of spheres. The layer at the walls is as dense as spheres at a wall can be,
    unlike the surface of a packing that is cut."""

    attempts: int | np.integer[Any]
    """Number of failed tries to place a sphere after which it is inserted by force; default: 500. Range: ≥ 1, ≤ 1,000,000."""
    coordination: Quantity | None
    """Insertion ends at this mean number of contacts of a sphere inside, more than two mean radii away from the walls; default: 6.2, unless
    another end is given. Range: > 0, ≤ 20."""
    correction: Correction
    """Links that become bonds, because softening opens contacts; default: "none": contacts. "frozen-links": pairs that touch before softening,
    held together by springs during it. "enlarged-radii": the nearest pairs after softening, as many per sphere inside as before. The last two
    determine the bonds, so `[bonds]` has no `interaction_ratio` and no `coordination`."""
    friction: Quantity
    """Friction coefficient between spheres while they relax; default: 0. The walls have none. Range: ≥ 0."""
    kind: Required[Literal["cooker"]]
    overlap: Quantity | None
    """Insertion ends at this mean overlap of touching spheres over the mean radius; default: see `coordination`. Range: > 0, ≤ 0.2."""
    packet: int | np.integer[Any] | None
    """Number of spheres in a forced insertion; default: 2 % of the expected number. 1 inserts one at a time. Range: ≥ 1, ≤ 100,000,000."""
    radii: Radii | None
    """Distribution of radii. Required unless `radius` is given. Example: `radii = { kind = "uniform", minimum = "0.875 mm", maximum = "1.125 mm"
    }`."""
    radius: Quantity | None
    """Radius of all spheres, m. Required unless `radii` is given. Example: `radius = "1 mm"`. Range: > 0."""
    seed: int | np.integer[Any]
    """Seed of the random numbers; default: 0. The same seed gives the same packing, bit by bit. Range: ≥ 0."""
    shape: Required[Shape]
    """Vessel: a box, a cylinder, or a mesh, without `keep`. Required. Example: `shape = { kind = "cylinder", radius = "10 mm", height = "40 mm"
    }`."""
    solid_fraction: Quantity | None
    """Insertion ends at this volume of all spheres over the volume of the shape; default: see `coordination`. Range: > 0, ≤ 0.9."""
    wall_softening: int | np.integer[Any]
    """Number of steps in which the stiffness of the walls falls to a thousandth, so that the packing expands until its overlaps vanish; default:
    6. 0 keeps the overlaps. Range: ≥ 0, ≤ 100."""


class PackingGrowth(TypedDict, total=False):
    """Spheres that grow in a cube with rigid walls, with friction, until they press on the walls. Radii follow from number and cube."""

    count: Required[int | np.integer[Any]]
    """Number of spheres. Required. Example: `count = 1000`. Range: ≥ 1, ≤ 100,000,000."""
    dispersion: Quantity
    """Difference of the largest and the smallest radius over the mean radius; default: 0. Radii are uniform between them. Range: ≥ 0, < 2."""
    friction: Quantity
    """Friction coefficient between spheres; default: 0.5. Range: ≥ 0."""
    kind: Required[Literal["growth"]]
    pressure: Quantity
    """Mean pressure on the walls at the end over Young's modulus of the spheres; default: 1e-4. Touching spheres then overlap by some thousandths
    of their radius. Range: ≥ 1e-07, ≤ 0.01."""
    seed: int | np.integer[Any]
    """Seed of the random numbers; default: 0. The same seed gives the same packing, bit by bit. Range: ≥ 0."""
    shape: Required[Shape]
    """Vessel: a box with three equal edges, without `keep`. Required. Example: `shape = { kind = "box", size = ["20 mm", "20 mm", "20 mm"] }`."""
    wall_friction: Quantity
    """Friction coefficient at the walls; default: 0. Range: ≥ 0."""


class PackingLattice(TypedDict, total=False):
    """Equal spheres on a lattice; nearest neighbors touch."""

    kind: Required[Literal["lattice"]]
    lattice: Required[Lattice]
    """Type of lattice. Required. Example: `lattice = "fcc"`."""
    radius: Required[Quantity]
    """Radius of all spheres, m. Required. Example: `radius = "1 mm"`. Range: > 0."""
    repeats: Sequence[int | np.integer[Any]] | NDArray[Any] | None
    """Number of unit cells along x, y, z. Required unless `shape` gives a size. Example: `repeats = [10, 10, 20]`."""
    shape: Shape | None
    """Shape that is filled with the lattice; default: a block of `repeats` unit cells."""


class PackingFile(TypedDict, total=False):
    """Spheres from a file: text with the columns x y z r, a comma-separated table, a data or dump file of LAMMPS, text of YADE, or an HDF5 sphere
    pack."""

    cell: Sequence[Quantity] | NDArray[Any] | None
    """Edge lengths of the periodic cell, m; default: not periodic. In two dimensions the third is 1 m, the depth of the discs. Example: `cell =
    ["10 mm", "10 mm", "10 mm"]`."""
    kind: Required[Literal["file"]]
    path: Required[_Path]
    """Path of the file, relative to the scenario. Required. Example: `path = "packing.txt"`."""
    shape: Shape | None
    """Shape that is cut out of the packing; default: all spheres."""
    unit: Quantity | None
    """Length of one unit of a text file, m; default: 1 m, or the unit in the header of a comma-separated table. Not for HDF5. Example: `unit = "1
    mm"`. Range: > 0."""


class PackingSpheres(TypedDict, total=False):
    """Spheres listed in the scenario."""

    cell: Sequence[Quantity] | NDArray[Any] | None
    """Edge lengths of the periodic cell, m; default: not periodic. In two dimensions the third is 1 m, the depth of the discs. Example: `cell =
    ["10 mm", "10 mm", "10 mm"]`."""
    kind: Required[Literal["spheres"]]
    spheres: Required[Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any]]
    """One `[x, y, z, radius]` per sphere, m. Required. Example: `spheres = [[0, 0, 0, "1 mm"]]`."""


class ParticleElasticity(TypedDict, total=False):
    """Elastic constants of particles that deform under their contacts (Madan 2019)."""

    poisson: Required[Quantity]
    """Poisson's ratio of the particles. Range: > -1, ≤ 0.5."""
    young: Required[Quantity]
    """Young's modulus of the particles, Pa. Range: > 0."""


class ParticleSet(TypedDict, total=False):
    """A named set of particles."""

    material: str | None
    """Name of the material of these particles; default: unchanged. A later set overrides an earlier one."""
    name: Required[str]
    """Name of the set. Required. Example: `name = "top"`."""
    selection: Required[Selection]
    """Particles of the set, by their initial position or number. Required. Example: `selection = { kind = "layer", axis = "z", end = "maximum",
    thickness = "2 mm" }`."""


class Phases(TypedDict, total=False):
    """Materials and aggregates of the spheres of the packing, one number each, in the order of the packing: what `[aggregates]` finds from shapes,
    given by another program."""

    aggregates: Sequence[int | np.integer[Any]] | NDArray[Any]
    """Number of the aggregate to which each sphere belongs, from 1; 0 for none; default: none. Bonds between two aggregates of one material have
    the `[[interface]]` of this material with itself, or with the first one. Example: `aggregates = [0, 0, 1]`."""
    materials: Required[Sequence[int | np.integer[Any]] | NDArray[Any]]
    """Number of the material of each sphere, from 0 in the order of `[[material]]`. Required. Example: `materials = [0, 0, 1]`."""


class Prescribe(TypedDict, total=False):
    """A prescribed motion of the particles of a set."""

    angular_velocity: Sequence[Quantity] | NDArray[Any]
    """Angular velocity, rad/s; a component "free" follows the moments. Default: all components free. Example: `angular_velocity = [0, 0, 0]`."""
    displacement: Sequence[Quantity] | NDArray[Any]
    """Displacement, m, which needs a `history`: this vector times the change of the factor since the start, so that the particles start where the
    packing has them. A component "free" follows the forces, or `velocity`. Default: all components free. Example: `displacement = ["free",
    "free", "1 mm"]`."""
    field: VelocityField | None
    """Velocity field: the velocity follows from the present position. Default: none. Example: `field = { kind = "rotation", point = [0, 0, 0],
    axis = [0, 0, 1], angular_velocity = "10 rad/s" }`."""
    history: str | None
    """Name of a history that multiplies velocity, angular velocity, displacement, and field; default: constant velocities."""
    set: Required[str]
    """Name of the set. Required."""
    velocity: Sequence[Quantity] | NDArray[Any]
    """Velocity, m/s; a component "free" follows the forces. Default: all components free. Example: `velocity = ["free", "free", "1 mm/s"]`. In a
    driven periodic cell, too, this is the velocity in space: `[0, 0, 0]` holds a particle in place while the cell deforms. With the kinematics
    "yade" and "yade-ratcheting" the cell carries the particle along, as YADE's cell does with blocked bodies; the velocity then changes by dL x
    when the velocity gradient L changes, and by L v dt in each step."""


class Radiation(TypedDict, total=False):
    """Radiation: heat `e s (T_o⁴ - T⁴)` per area, with the Stefan-Boltzmann constant s."""

    ambient: Required[Quantity]
    """Temperature of the surroundings, K. Required. Range: ≥ 0."""
    emissivity: Required[Quantity]
    """Emissivity. Required. Range: > 0, ≤ 1."""


class RadiiUniform(TypedDict, total=False):
    """Uniform distribution between two radii."""

    kind: Required[Literal["uniform"]]
    maximum: Required[Quantity]
    """Largest radius, m. Required. Range: > 0."""
    minimum: Required[Quantity]
    """Smallest radius, m. Required. Range: > 0."""


class RadiiLogNormal(TypedDict, total=False):
    """Log-normal distribution, truncated at both ends."""

    deviation: Required[Quantity]
    """Standard deviation of the natural logarithm of the radius. Required. Example: `deviation = 0.2`. Range: > 0."""
    kind: Required[Literal["log-normal"]]
    maximum: Required[Quantity]
    """Largest radius, m. Required. Range: > 0."""
    median: Required[Quantity]
    """Median radius, m. Required. Range: > 0."""
    minimum: Required[Quantity]
    """Smallest radius, m. Required. Range: > 0."""


class RadiiTable(TypedDict, total=False):
    """A list of radii and the fraction of spheres that have each radius."""

    kind: Required[Literal["table"]]
    radii: Required[Sequence[Quantity] | NDArray[Any]]
    """Radii, m. Required. Example: `radii = ["1 mm", "2 mm"]`."""
    shares: Required[Sequence[Quantity] | NDArray[Any]]
    """Fractions by number of spheres, one per radius; they are normalized to a sum of 1. Required. Example: `shares = [0.7, 0.3]`."""


class SamplePlane(TypedDict, total=False):
    """A plane that bounds a region."""

    normal: Required[Sequence[Quantity] | NDArray[Any]]
    """Normal vector of any length that points out of the region. Required. Example: `normal = [0, 0, 1]`."""
    point: Required[Sequence[Quantity] | NDArray[Any]]
    """A point on the plane, m. Required."""


class SampleRegionAll(TypedDict, total=False):
    """All particles, in the volume of the specimen."""

    kind: Required[Literal["all"]]
    volume: Required[Quantity]
    """Volume of the specimen, m³. Required. Example: `volume = "16 cm^3"`. Range: > 0."""


class SampleRegionCell(TypedDict, total=False):
    """The periodic cell."""

    kind: Required[Literal["cell"]]


class SampleRegionBox(TypedDict, total=False):
    """A box with edges along the axes."""

    kind: Required[Literal["box"]]
    maximum: Required[Sequence[Quantity] | NDArray[Any]]
    """Corner with the largest coordinates, m. Required."""
    minimum: Required[Sequence[Quantity] | NDArray[Any]]
    """Corner with the smallest coordinates, m. Required."""


class SampleRegionSphere(TypedDict, total=False):
    """A sphere; in two dimensions a disc of unit depth."""

    center: Required[Sequence[Quantity] | NDArray[Any]]
    """Center, m. Required."""
    kind: Required[Literal["sphere"]]
    radius: Required[Quantity]
    """Radius, m. Required. Range: > 0."""


class SampleRegionCylinder(TypedDict, total=False):
    """A circular cylinder with flat ends."""

    axis: Required[Sequence[Quantity] | NDArray[Any]]
    """Direction of the axis, a vector of any length. Required. Example: `axis = [0, 0, 1]`."""
    center: Required[Sequence[Quantity] | NDArray[Any]]
    """Center, m. Required."""
    height: Required[Quantity]
    """Height, m. Required. Range: > 0."""
    kind: Required[Literal["cylinder"]]
    radius: Required[Quantity]
    """Radius, m. Required. Range: > 0."""


class SampleRegionEllipsoid(TypedDict, total=False):
    """An ellipsoid with its axes along x, y, z."""

    center: Required[Sequence[Quantity] | NDArray[Any]]
    """Center, m. Required."""
    half_axes: Required[Sequence[Quantity] | NDArray[Any]]
    """Semi-axes, m. Required."""
    kind: Required[Literal["ellipsoid"]]


class SampleRegionHalfSpaces(TypedDict, total=False):
    """The intersection of half-spaces."""

    kind: Required[Literal["half-spaces"]]
    planes: Required[Sequence[SamplePlane]]
    """Planes that bound the half-spaces. Required."""
    volume: Required[Quantity]
    """Volume of the region, m³. Required. Range: > 0."""


class SampleRegionSet(TypedDict, total=False):
    """The particles of a set."""

    kind: Required[Literal["set"]]
    set: Required[str]
    """Name of the set. Required."""
    volume: Required[Quantity]
    """Volume that these particles represent, m³. Required. Range: > 0."""


class SampleRegionMaterial(TypedDict, total=False):
    """The particles of a material."""

    kind: Required[Literal["material"]]
    material: Required[str]
    """Name of the material. Required."""
    volume: Required[Quantity]
    """Volume that these particles represent, m³. Required. Range: > 0."""


class SelectionAll(TypedDict, total=False):
    """All particles."""

    kind: Required[Literal["all"]]


class SelectionBox(TypedDict, total=False):
    """Particles inside a box."""

    kind: Required[Literal["box"]]
    maximum: Required[Sequence[Quantity] | NDArray[Any]]
    """Corner with the largest coordinates, m. Required."""
    minimum: Required[Sequence[Quantity] | NDArray[Any]]
    """Corner with the smallest coordinates, m. Required."""


class SelectionSphere(TypedDict, total=False):
    """Particles inside a sphere."""

    center: Required[Sequence[Quantity] | NDArray[Any]]
    """Center, m. Required."""
    kind: Required[Literal["sphere"]]
    radius: Required[Quantity]
    """Radius, m. Required. Range: > 0."""


class SelectionLayer(TypedDict, total=False):
    """Particles within a distance of one end of the bounding box of all spheres."""

    axis: Required[Axis]
    """Axis of the layer. Required."""
    end: Required[End]
    """End of the axis. Required."""
    kind: Required[Literal["layer"]]
    thickness: Required[Quantity]
    """Thickness of the layer, m. Required. Example: `thickness = "2 mm"`. Range: > 0."""


class SelectionIds(TypedDict, total=False):
    """Particles by number, counted from 0 in the order of the packing; the spheres of `[[clump]]` follow."""

    ids: Required[Sequence[int | np.integer[Any]] | NDArray[Any]]
    """Numbers of the particles. Required. Example: `ids = [0, 1]`."""
    kind: Required[Literal["ids"]]


class Servo(TypedDict, total=False):
    """A servo: the wall moves along its direction with the speed `min(g (F0 - F), maximum_speed)`, F being the force on the particles in the last
    step. The gain g follows from the stiffness of the contacts, so that the wall does not oscillate. With `opening` the wall moves so that the
    elongation of a gauge is a given one, as in `loading.opening`."""

    area: Quantity | None
    """Area on which the pressure acts, m². Required with `pressure`, but not for a "box": the pressure on its faces acts on their present area
    between the neighboring faces. Example: `area = "36 mm^2"`. Range: > 0."""
    direction: Sequence[Quantity] | NDArray[Any] | None
    """Direction in which the wall pushes, a vector of any length. Required for "cylinder", "plate", and "facets", which move as a whole; a "plane"
    and the faces of a "box" push along their normals."""
    force: Quantity | None
    """Wanted force on the particles, N. Required unless `pressure` or `opening` is given. Not for a "box". Range: > 0."""
    gain: Quantity | None
    """Displacement of the wall per error of the opening, at once; default: 0.5. Only with `opening`. Range: > 0."""
    gauge: str | None
    """Name of a `[[sample]]` with the operator "gauge". Required with `opening`. Example: `gauge = "crack mouth"`."""
    maximum_speed: Required[Quantity]
    """Largest speed of the wall, m/s. Required. It has this speed until a tenth of the force is missing. Example: `maximum_speed = "0.1 m/s"`.
    Range: > 0."""
    opening: Quantity | None
    """Wanted elongation of a gauge, m, positive or negative: that which grows as the wall moves along its direction. Required unless `force` or
    `pressure` is given. The `history` of the wall multiplies it. Not for a "box". Example: `opening = "0.1 mm"`."""
    pressure: Quantity | None
    """Wanted pressure on the particles, Pa. Required unless `force` or `opening` is given. Each face of a "box" has it. Range: > 0."""
    response_time: Quantity | None
    """Time in which the wall makes up for an error of the opening, s, about a quarter of the period of the slowest vibration of the specimen.
    Required with `opening`. Example: `response_time = "50 us"`. Range: > 0."""


class ShapeBox(TypedDict, total=False):
    """A box with edges along the axes."""

    center: Sequence[Quantity] | NDArray[Any] | None
    """Coordinates of the center, m; default: the origin. Example: `center = ["0 mm", "0 mm", "25 mm"]`."""
    keep: Crop | None
    """Which spheres stay: "centers" keeps those whose centers lie inside or on the surface, "whole-spheres" those that lie entirely inside, both
    up to 1e-9 of the radius; default: "whole-spheres" for a lattice, "centers" for other packings."""
    kind: Required[Literal["box"]]
    size: Required[Sequence[Quantity] | NDArray[Any]]
    """Edge lengths, m. Required. Example: `size = ["15 mm", "15 mm", "30 mm"]`."""


class ShapeCylinder(TypedDict, total=False):
    """A circular cylinder."""

    axis: Axis
    """Direction of the axis; default: "z"."""
    center: Sequence[Quantity] | NDArray[Any] | None
    """Coordinates of the center, m; default: the origin. Example: `center = ["0 mm", "0 mm", "25 mm"]`."""
    height: Required[Quantity]
    """Height, m. Required. Range: > 0."""
    keep: Crop | None
    """Which spheres stay: "centers" keeps those whose centers lie inside or on the surface, "whole-spheres" those that lie entirely inside, both
    up to 1e-9 of the radius; default: "whole-spheres" for a lattice, "centers" for other packings."""
    kind: Required[Literal["cylinder"]]
    radius: Required[Quantity]
    """Radius, m. Required. Range: > 0."""


class ShapeHyperboloid(TypedDict, total=False):
    """A hyperboloid of one sheet: a cylinder with a waist."""

    axis: Axis
    """Direction of the axis; default: "z"."""
    center: Sequence[Quantity] | NDArray[Any] | None
    """Coordinates of the center, m; default: the origin. Example: `center = ["0 mm", "0 mm", "25 mm"]`."""
    height: Required[Quantity]
    """Height, m. Required. Range: > 0."""
    keep: Crop | None
    """Which spheres stay: "centers" keeps those whose centers lie inside or on the surface, "whole-spheres" those that lie entirely inside, both
    up to 1e-9 of the radius; default: "whole-spheres" for a lattice, "centers" for other packings."""
    kind: Required[Literal["hyperboloid"]]
    radius: Required[Quantity]
    """Radius at both ends, m. Required. Range: > 0."""
    waist_radius: Required[Quantity]
    """Radius in the middle, m. Required. Range: > 0."""


class ShapeMesh(TypedDict, total=False):
    """The interior of a closed triangulated surface."""

    keep: Crop | None
    """Which spheres stay: "centers" keeps those whose centers lie inside or on the surface, "whole-spheres" those that lie entirely inside, both
    up to 1e-9 of the radius; default: "whole-spheres" for a lattice, "centers" for other packings."""
    kind: Required[Literal["mesh"]]
    path: Required[_Path]
    """Path of the STL file, relative to the scenario. Required. Example: `path = "specimen.stl"`."""
    unit: Quantity
    """Length of one unit of the file, m; default: 1 m. Example for a file in millimeters: `unit = "1 mm"`. Range: > 0."""


class ShapePeriodic(TypedDict, total=False):
    """The periodic cell itself, optionally repeated."""

    kind: Required[Literal["periodic"]]
    tiles: Sequence[int | np.integer[Any]] | NDArray[Any]
    """Number of copies of the cell along x, y, z; default: `[1, 1, 1]`."""


class Slave(TypedDict, total=False):
    """Particles or a mesh that repeat the motion in a file, such as that of a run coupled with finite elements. The file has NumPy's format .npy
    with 64-bit numbers and three axes: steps plus one, particles or vertices, components. Entry 0 is the motion before the first step, entry k
    that of step k, counted from 1. `[stop]` needs `steps`, at most those of the file."""

    path: Required[_Path]
    """File with the motion. Required. Example: `path = "slaves.npy"`."""
    set: str | None
    """Name of a set. A `[[prescribe]]` without a history prescribes all components of velocity and angular velocity of its particles; the file
    gives their values, by ascending id: six components, m/s and rad/s. Give either `set` or `wall`."""
    wall: str | None
    """Name of a wall of the kind "mesh" without `motion`. Three components: velocities of the vertices in each step, m/s. Six: their places (m)
    after each step, and the velocities (m/s) with which they came there."""


class SofteningBeam(TypedDict, total=False):
    """Cohesive beam whose strength ends gradually, by a fracture energy per area."""

    bending_term: BendingTerm
    """Bending moment in the stress that `tensile_strength` limits."""
    cohesion: Quantity | None
    """Shear stress at which a beam without normal force breaks, Pa (Potyondy and Cundall 2004). With this key a beam breaks in tension or in
    shear; without it, at its largest principal stress. Range: > 0."""
    fracture_energy: Required[Quantity]
    """Energy per area of a beam that tension and bending take to break it, J/m^2. Between two materials: the mean. Range: > 0."""
    friction_angle: Quantity | None
    """Angle of friction in the shear strength, rad; only with `cohesion`. Range: ≥ 0."""
    friction_coefficient: Quantity | None
    """Tangent of the angle of friction in the shear strength; or give `friction_angle`; only with `cohesion`. Default: 0. Range: ≥ 0."""
    hydrostatic_strength: Quantity | None
    """Mean stress of a particle at which all its beams break, Pa; no such failure if left out. Range: > 0."""
    mixture_exponent: Quantity | None
    """Exponent of the mixture of both (Benzeggagh and Kenane 1996); only with `shear_fracture_energy`. Default: 1. Range: > 0."""
    model: BeamModel
    """Deformations that the bond resists."""
    moment_share: Quantity | None
    """Share of bending and twisting moments in the stresses of a beam, from 0 to 1; only with `cohesion`. Default: 1. Range: ≥ 0, ≤ 1."""
    poisson: Quantity
    """Poisson's ratio of the beam. Range: > -1, ≤ 0.5."""
    radius: Quantity | None
    """Radius of the beam, m; or give `radius_ratio`. Range: > 0."""
    radius_ratio: Quantity | None
    """Radius of the beam divided by the radius that `radius_rule` names; or give `radius`. Range: > 0."""
    radius_rule: RadiusRule | None
    """Radius that `radius_ratio` multiplies; only with `radius_ratio`. Default: the mean over all bonded particles."""
    shear_coefficient: Quantity | None
    """Shear coefficient of the section; 0.9 if left out; only with model "timoshenko". Range: > 0."""
    shear_fracture_energy: Quantity | None
    """Energy per area of a beam that shear and twist take to break it, J/m^2. Default: `fracture_energy`. Range: > 0."""
    shear_ratio: Quantity | None
    """Tangential stiffness divided by normal stiffness; only with model "dual-spring". Range: ≥ 0."""
    softening: Softening
    """How the force falls over the deformation."""
    tensile_strength: Quantity | None
    """Largest principal stress on the surface of a beam at which it breaks, Pa, with `cohesion` the largest normal stress; unbreakable if left
    out. Between two materials: the mean, or the only one given. Range: > 0."""
    young: Required[Quantity]
    """Young's modulus of the beam, Pa. Range: > 0."""


class Stage(TypedDict, total=False):
    """A stage of the loading. Stages follow each other; the run ends with the last one."""

    control: Control
    """What the axes with a `strain_rate` follow in "cell-stress" loading; default: "strain-rate"."""
    history: str | None
    """Name of a history that multiplies `rate`; its time starts with the stage. Default: none."""
    name: Required[str]
    """Name of the stage. Required. Example: `name = "unload"`."""
    rate: Quantity
    """Factor of the rate of `loading`, or of the target of "cell-stress" loading if no axis follows a strain rate; default: 1. -1 reverses the
    motion, 0 holds it."""
    stop: Required[StageStop]
    """Conditions that end the stage; the first one that holds ends it. Required: at least one."""


class StageStop(TypedDict, total=False):
    """Conditions that end a stage; the first one that holds ends it. All are checked with each row of the results (`output.sample_interval`),
    `steps` after every step."""

    drop_to: Quantity | None
    """The stress drops to this fraction of its peak in the stage, to which the stress at its start belongs: a stage that unloads drops from there.
    Example: `drop_to = 0.5`. Range: ≥ 0, < 1."""
    steps: int | np.integer[Any] | None
    """Steps since the start of the stage. Example: `steps = 2000`. Range: ≥ 1."""
    strain: Quantity | None
    """The strain passes this value, from above or below. Example: `strain = 5e-4`."""
    stress: Quantity | None
    """The stress passes this value, Pa, from above or below. Example: `stress = 0`."""
    time: Quantity | None
    """Time since the start of the stage, s. Example: `time = "0.2 ms"`. Range: > 0."""
    unbalanced: Quantity | None
    """Equilibrium, as in `stop` of the run. Example: `unbalanced = 1e-3`. Range: > 0."""


class Stop(TypedDict, total=False):
    """Conditions that end the run; the first one that holds ends it. At least one is required."""

    drop_to: Quantity | None
    """Stress drops to this fraction of its peak. While a stage unloads, or loads again up to where the run had come, it does not count. Example:
    `drop_to = 0.2`. Range: ≥ 0, < 1."""
    steps: int | np.integer[Any] | None
    """Number of steps. Example: `steps = 20_000`. Range: ≥ 1."""
    strain: Quantity | None
    """Magnitude of the strain along the loading axis (periodic cell: of the largest strain component). Example: `strain = 5e-3`. Range: > 0."""
    time: Quantity | None
    """Time since the start of the run, s. Example: `time = "0.6 ms"`. Range: > 0."""
    unbalanced: Quantity | None
    """Equilibrium: the root mean square of the net forces on particles and clumps, divided by that of the contact forces, falls below this value,
    and so does the same ratio of moments. Example: `unbalanced = 1e-3`. Range: > 0."""


class StrengthScatter(TypedDict, total=False):
    """Strengths of the bonds of a material that differ by chance: factors on all stresses or forces at which a bond fails or slips, with the mean
    1. A bond between two materials has the mean of both factors. Example: `strength_scatter = { weibull_modulus = 8, seed = 1 }`."""

    correlation_length: Quantity | None
    """Distance over which strengths are alike, m: the factors are a random field of the place of the particles at the start, and a bond has the
    mean of its two particles. The normal numbers behind them correlate by `exp(−(r/ℓ)²)` (Eliáš et al. 2015). Not in hosts. Default: each bond
    has a factor of its own. Example: `correlation_length = "20 mm"`. Range: > 0."""
    log_normal_variation: Quantity | None
    """Standard deviation over mean of a log-normal distribution; or give `weibull_modulus`. Range: > 0."""
    reference_area: Quantity | None
    """Cross-section of a bond whose mean factor is 1, m²: larger bonds are weaker, by the weakest link; default: the cross-section has no
    influence; only with `weibull_modulus`. Range: > 0."""
    seed: int | np.integer[Any]
    """Seed; another one gives other strengths. Default: 0. Range: ≥ 0."""
    weibull_modulus: Quantity | None
    """Modulus of a Weibull distribution; or give `log_normal_variation`. Range: > 0."""


class Thermal(TypedDict, total=False):
    """Thermal constants."""

    bulk_density: Quantity | None
    """Density of the bulk, kg/m³, which the volumes of the cells of the particles refer to; default: the mass of the particles divided by the
    volume of their cells, so that all particles together have the heat capacity of their mass. Range: > 0."""
    conductivity: Required[Quantity]
    """Thermal conductivity, W/(m·K). Required. Range: ≥ 0."""
    expansion: Quantity
    """Linear thermal expansion of bonds, 1/K; default: 0."""
    specific_heat: Required[Quantity]
    """Heat capacity per mass, J/(kg·K). Required. Range: > 0."""
    variation: ThermalVariation | None
    """How the constants vary with the temperature; default: not at all. Example: `variation = { temperature = ["300 K", "900 K"], specific_heat =
    [1, 1.4], conductivity = [1, 0.6] }`."""


class ThermalVariation(TypedDict, total=False):
    """Factors on the constants of a material at given temperatures: linear in between, constant below the first and above the last temperature."""

    conductivity: Sequence[Quantity] | NDArray[Any] | None
    """Factors on the conductivity; default: 1."""
    expansion: Sequence[Quantity] | NDArray[Any] | None
    """Factors on the thermal expansion, `d(strain)/dT`; default: 1."""
    specific_heat: Sequence[Quantity] | NDArray[Any] | None
    """Factors on the heat capacity, one per temperature; default: 1."""
    stiffness: Sequence[Quantity] | NDArray[Any] | None
    """Factors on the stiffness of bonds, and of contacts between particles; default: 1. A bond has the mean of its two particles."""
    strength: Sequence[Quantity] | NDArray[Any] | None
    """Factors on the strength of bonds: on all stresses or forces at which they fail or slip; default: 1. A bond has the mean of its two
    particles."""
    temperature: Required[Sequence[Quantity] | NDArray[Any]]
    """Temperatures in ascending order, at least two, K. Required."""


class VelocityFieldRotation(TypedDict, total=False):
    """Rotation of the set as a rigid body: the particles stay on circles about the axis, and turn about their centers with the same angular
    velocity."""

    angular_velocity: Required[Quantity]
    """Angular velocity, rad/s, by the right-hand rule. Required. Example: `angular_velocity = "10 rad/s"`."""
    axis: Required[Sequence[Quantity] | NDArray[Any]]
    """Direction of the axis, a vector of any length. Required. Example: `axis = [0, 0, 1]`."""
    free: Sequence[Axis]
    """Axes along which the particles follow the forces instead of the field; default: none. Example: `free = ["z"]`."""
    kind: Required[Literal["rotation"]]
    point: Required[Sequence[Quantity] | NDArray[Any]]
    """A point of the axis, m. Required."""


class VelocityFieldLinear(TypedDict, total=False):
    """Affine motion `v = L (x - x0)`: strain, rotation, or both. Rotations of the particles follow `angular_velocity`."""

    free: Sequence[Axis]
    """Axes along which the particles follow the forces instead of the field; default: none. Example: `free = ["z"]`."""
    kind: Required[Literal["linear"]]
    point: Sequence[Quantity] | NDArray[Any]
    """The point `x0` without velocity, m; default: the origin."""
    velocity_gradient: Required[Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any]]
    """Velocity gradient L, 1/s: row i, column j is the derivative of velocity component i along axis j. Required. Example, pure shear:
    `velocity_gradient = [[0, 0.1, 0], [0.1, 0, 0], [0, 0, 0]]`."""


class Wall(TypedDict, total=False):
    """A rigid wall that particles touch."""

    history: str | None
    """Name of a history that multiplies the velocity, or the force or pressure of the servo; default: constant."""
    material: Required[str]
    """Name of the material of the wall. Required."""
    motion: MeshMotion | None
    """Motion of the vertices of a "mesh"; default: none, they stay where they are, or where Python puts them. Only for "mesh". Example: `motion =
    { rotation = [0, 0, "360 deg"], center = [0, 0, 0], history = "turn" }`."""
    name: str | None
    """Name in results; default: "wall N", counted from 0. Example: `name = "floor"`."""
    rotation: WallRotation | None
    """Rotation about the normal of a "plane" or a round "plate", or the axis of a "cylinder"; default: none. Particles feel the velocity of the
    turning surface. Example: `rotation = { angular_velocity = "10 rad/s" }`."""
    servo: Servo | None
    """Servo: the wall moves until it presses on the particles with a given force or pressure. Default: none, the wall moves with `velocity`.
    Example: `servo = { pressure = "2 MPa", maximum_speed = "0.1 m/s" }`."""
    shape: Required[WallShape]
    """Surface of the wall. Required. Example: `shape = { kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }`."""
    velocity: Sequence[Quantity] | NDArray[Any]
    """Velocity of the wall, m/s; default: zero. Example: `velocity = [0, 0, "-1 mm/s"]`."""


class WallRotation(TypedDict, total=False):
    """Rotation of a plane or a round plate about its normal, or of a cylinder about its axis."""

    angular_velocity: Required[Quantity]
    """Angular velocity, rad/s, by the right-hand rule about the normal or the axis. Required. Example: `angular_velocity = "10 rad/s"`."""
    history: str | None
    """Name of a history that multiplies the angular velocity; default: constant."""
    point: Sequence[Quantity] | NDArray[Any] | None
    """A point of the axis about which a "plane" turns, m; it moves with the wall. Default: the `point` of the shape. Not for a "cylinder" and a
    "plate", which turn about their own axes."""


class WallShapePlane(TypedDict, total=False):
    """An infinite plane."""

    kind: Required[Literal["plane"]]
    normal: Required[Sequence[Quantity] | NDArray[Any]]
    """Direction from the wall to the particles, a vector of any length. Required. Example: `normal = [0, 0, 1]`."""
    point: Required[Sequence[Quantity] | NDArray[Any]]
    """A point on the plane, m. Required."""


class WallShapeBox(TypedDict, total=False):
    """The six faces of a box with the particles inside; each face is a separate wall."""

    kind: Required[Literal["box"]]
    maximum: Required[Sequence[Quantity] | NDArray[Any]]
    """Corner with the largest coordinates, m. Required."""
    minimum: Required[Sequence[Quantity] | NDArray[Any]]
    """Corner with the smallest coordinates, m. Required."""


class WallShapeCylinder(TypedDict, total=False):
    """A circular cylinder, infinite along its axis or of a given `length`."""

    axis: Axis
    """Direction of the axis; default: "z"."""
    center: Required[Sequence[Quantity] | NDArray[Any]]
    """A point on the axis, m; with `length` the center. Required."""
    kind: Required[Literal["cylinder"]]
    length: Quantity | None
    """Length along the axis, m; default: infinite. With the particles outside, the cylinder then is a solid rod with flat ends; inside it is a
    tube with open ends, which particles touch from both sides. Range: > 0."""
    radius: Required[Quantity]
    """Radius, m. Required. Range: > 0."""
    side: Side
    """Side on which the particles are; default: "inside"."""


class WallShapePlate(TypedDict, total=False):
    """A flat plate without thickness; particles touch it from both sides. A rectangle has `edges`, a disc `normal` and `radius`."""

    center: Required[Sequence[Quantity] | NDArray[Any]]
    """Center, m. Required."""
    edges: Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any] | None
    """Two neighboring edges of a rectangle, vectors perpendicular to each other, m. Example: `edges = [["20 mm", 0, 0], [0, "10 mm", 0]]`."""
    kind: Required[Literal["plate"]]
    normal: Sequence[Quantity] | NDArray[Any] | None
    """Direction across a disc, a vector of any length. Example: `normal = [0, 0, 1]`."""
    radius: Quantity | None
    """Radius of a disc, m. Range: > 0."""


class WallShapeFacets(TypedDict, total=False):
    """Triangles of an STL file; particles touch them from both sides."""

    kind: Required[Literal["facets"]]
    path: Required[_Path]
    """Path of the STL file, relative to the scenario. Required. Example: `path = "hopper.stl"`."""
    unit: Quantity
    """Length of one unit of the file, m; default: 1 m. Example for a file in millimeters: `unit = "1 mm"`. Range: > 0."""


class WallShapeMesh(TypedDict, total=False):
    """Triangles whose vertices move with `motion`, or by calls from Python; particles touch them from both sides. Give `path`, or `vertices` and
    `triangles`."""

    kind: Required[Literal["mesh"]]
    path: _Path | None
    """Path of an STL file, relative to the scenario. Its vertices are numbered in the order in which they first appear. Example: `path =
    "drum.stl"`."""
    triangles: Sequence[Sequence[int | np.integer[Any]] | NDArray[Any]] | NDArray[Any] | None
    """Vertices of each triangle, counted from 0. Example: `triangles = [[0, 1, 2]]`."""
    unit: Quantity | None
    """Length of one unit of the file, m; default: 1 m. Example for a file in millimeters: `unit = "1 mm"`. Range: > 0."""
    vertices: Sequence[Sequence[Quantity] | NDArray[Any]] | NDArray[Any] | None
    """Positions of the vertices at the start, m. Example: `vertices = [[0, 0, 0], ["1 mm", 0, 0], [0, "1 mm", 0]]`."""


class ScenarioTables(TypedDict, total=False):
    """A scenario. Numbers are in SI units or strings with a unit (`"30 GPa"`); tension is positive."""

    aggregates: Aggregates | None
    """Aggregates and pores, which divide the particles of the packing; default: none."""
    author: str
    """Author, or several, for reports; default: empty. Example: `author = "A. Mason, Testing Laboratory"`."""
    bonding: Bonding | Sequence[Bonding]
    """Bonds made during the run; default: none."""
    bonds: Bonds | None
    """Bonds, made at the start unless `at_start` is false; default: none."""
    clump: Clump | Sequence[Clump]
    """Rigid bodies made of several spheres; default: none."""
    contacts: Required[Contacts]
    """Contacts between particles without a bond, and with walls. Required."""
    cut: Cut | Sequence[Cut]
    """Notches, holes, and cracks that exist from the start; default: none."""
    deformable: Deformable | None
    """Options of deformable particles (those whose material has a table `deformable`); default: see its keys."""
    dimension: Literal[2, 3]
    """Number of space dimensions; default: 3. With 2, particles are discs of unit depth in the plane z = 0. Range: ≥ 0, ≤ 255."""
    fibers: Fibers | None
    """Fibers in the packing; default: none."""
    force: AppliedForce | Sequence[AppliedForce]
    """Forces on particles; default: none."""
    heat: Heat | None
    """Heat conduction and thermal expansion; default: none."""
    history: History | Sequence[History]
    """Factors that change with time, for motions, forces, walls, and stages; default: none."""
    initial: Initial | Sequence[Initial]
    """Initial velocities; default: zero. A later one overrides an earlier one."""
    integration: Integration
    """Time integration, damping, and gravity; default: see its keys."""
    interface: Interface | Sequence[Interface]
    """Parameters for contacts between two materials, instead of the averages of both materials."""
    joint: Joint | Sequence[Joint]
    """Joints of rock, along which bonds and contacts of the law "jointed" slide; default: none."""
    kinematics: MotionMeasure
    """Kinematics: how relative motion at contacts is measured; default: "finite"."""
    loading: Loading
    """Loading of the specimen; default: none."""
    material: Required[Material | Sequence[Material]]
    """Materials; at least one is required."""
    membrane: Membrane | Sequence[Membrane]
    """Flexible membranes that press on the specimen; default: none."""
    output: Output
    """Output; default: see its keys."""
    packing: Required[Packing]
    """Initial positions and radii of the particles. Required."""
    phases: Phases | None
    """Materials and aggregates of given particles, instead of `aggregates`; default: none."""
    prescribe: Prescribe | Sequence[Prescribe]
    """Prescribed motions; default: none. A later one overrides an earlier one, component by component."""
    sample: OperatorSample | Sequence[OperatorSample]
    """Operators that are evaluated during the run; default: none."""
    set: ParticleSet | Sequence[ParticleSet]
    """Named sets of particles; default: none."""
    slave: Slave | Sequence[Slave]
    """Particles and meshes that repeat the motion in a file; default: none."""
    stage: Stage | Sequence[Stage]
    """Stages of the loading, in their order; default: one stage of constant rate, until `stop` ends it."""
    stop: Stop
    """End of the run. Required without stages: at least one of its keys."""
    title: str
    """Title for reports; default: empty. Example: `title = "Column collapse"`."""
    version: Literal[1]
    """Version of the format. Required: `version = 1`. Range: ≥ 0."""
    wall: Wall | Sequence[Wall]
    """Rigid walls; default: none."""


#: Shape of aggregates or pores, in random orientation.
AggregateShape: TypeAlias = AggregateShapeSphere | AggregateShapeEllipsoid | AggregateShapePolyhedron | AggregateShapeMesh
#: A coordinate axis.
Axis: TypeAlias = Literal["x", "y", "z"]
#: Models of a cohesive bond.
BeamModel: TypeAlias = Literal["euler-bernoulli", "timoshenko", "dual-spring", "spring"]
#: Bending moment in the failure criterion.
BendingTerm: TypeAlias = Literal["mid-section", "half-sum", "larger-end"]
#: Relation between the strains and stresses of a particle.
Condition: TypeAlias = Literal["solid", "plane-strain", "plane-stress"]
#: Law of contacts without a bond.
ContactLawName: TypeAlias = Literal["none", "cpm", "linear_bond", "jointed", "frictional", "hertz_mindlin"]
#: What the axes with a strain rate follow in a stage.
Control: TypeAlias = Literal["strain-rate", "stress"]
#: How the network of links is kept or completed when softening opens contacts (section 2.3.1.3 of the source).
Correction: TypeAlias = Literal["none", "frozen-links", "enlarged-radii"]
#: Published form of the law. The book lists the differences.
CpmFormulation: TypeAlias = Literal["thesis", "yade-public", "woo"]
#: Which spheres belong to a cropped body.
Crop: TypeAlias = Literal["whole-spheres", "centers"]
#: Shape of a cut. A bond crosses it if the straight line between the two centers does. In a periodic cell all images of the shape cut.
CutShape: TypeAlias = CutShapeLine | CutShapeParallelogram | CutShapeBox | CutShapeSphere | CutShapeCylinder | CutShapeFacets
#: Form of the damage function g(κ).
DamageLaw: TypeAlias = Literal["linear", "exponential"]
#: Numerical damping.
Damping: TypeAlias = DampingNone | DampingLocal | DampingNonviscous | DampingTchamwaWielgosz
#: Term that the weight of the acceleration multiplies in damping by the integrator.
DampingForm: TypeAlias = Literal["tchamwa-wielgosz", "position-term"]
#: When the strains of deformable particles are computed.
DeformableUpdate: TypeAlias = Literal["lagged", "iterated"]
#: End of an axis.
End: TypeAlias = Literal["minimum", "maximum"]
#: Sizes of aggregates. The size is the opening of a sieve: the middle one of the three widths of an aggregate.
GradingTable: TypeAlias = GradingTableSieves | GradingTableFuller | GradingTableStransky | GradingTableSingle
#: How heat flows between particles.
HeatNetwork: TypeAlias = Literal["power", "disordered", "ordered", "contacts"]
#: Pairs that exchange heat.
HeatPairs: TypeAlias = Literal["contacts", "bonds"]
#: Time integration of heat conduction.
HeatScheme: TypeAlias = Literal["explicit", "implicit"]
#: A factor over time. The time of a stage starts with the stage, all others with the run.
HistoryShape: TypeAlias = HistoryShapeTable | HistoryShapeSine | HistoryShapeExpression
#: Where a joint lies at the start. A particle belongs to the side on which its center lies; one on the joint to the front, to which the normal
#: points.
JointShape: TypeAlias = JointShapePlane | JointShapeDisc | JointShapeFacets
#: Motion of end layers across the axis of loading.
Lateral: TypeAlias = Literal["free", "fixed"]
#: Type of lattice; nearest neighbors touch.
Lattice: TypeAlias = Literal["sc", "bcc", "fcc", "hcp", "square", "triangular"]
#: Laws of bonds, by the name of their parameter table.
LawName: TypeAlias = Literal["cpm", "linear_bond", "cohesive_beam", "damped_beam", "softening_beam", "jointed"]
#: Loading of the specimen.
Loading: TypeAlias = LoadingNone | LoadingUniaxial | LoadingBending | LoadingTorsion | LoadingCellStrain | LoadingCellStress | LoadingPlatens | LoadingFlexure
#: How relative motion is measured.
MotionMeasure: TypeAlias = Literal["finite", "first-order", "yade", "yade-ratcheting"]
#: An operator that can be evaluated during a run.
Operator: TypeAlias = Literal["region-stress", "particle-stress", "boundary-stress", "wall-traction", "wall-moment", "set-force", "set-motion", "gauge", "couple-stress", "affine-strain", "affine-rate", "cell-strain", "cell-rate", "contact-cell-strain", "contact-cell-rate", "fabric", "porosity", "temperature", "heat-flux", "damage-tensor", "power", "coarse-grain"]
#: Initial positions and radii of the particles.
Packing: TypeAlias = PackingRandomDense | PackingRandomDiscs | PackingCooker | PackingGrowth | PackingLattice | PackingFile | PackingSpheres
#: Division of the branch vector of a contact between its two particles.
Partition: TypeAlias = Literal["contact-point", "half-branch"]
#: Where an external force acts on its particle.
PointOfAction: TypeAlias = Literal["body", "pull", "push"]
#: Measure of pressure, and end of the compaction.
Protocol: TypeAlias = Literal["jammed", "yade"]
#: Distribution of radii, by number of spheres.
Radii: TypeAlias = RadiiUniform | RadiiLogNormal | RadiiTable
#: Radius that the ratio of a beam's radius refers to.
RadiusRule: TypeAlias = Literal["mean-of-all", "smaller", "mean", "harmonic-mean"]
#: Region in which an operator is evaluated.
SampleRegion: TypeAlias = SampleRegionAll | SampleRegionCell | SampleRegionBox | SampleRegionSphere | SampleRegionCylinder | SampleRegionEllipsoid | SampleRegionHalfSpaces | SampleRegionSet | SampleRegionMaterial
#: Integration scheme.
Scheme: TypeAlias = Literal["leapfrog", "velocity-verlet"]
#: A selection of particles, including the spheres of `[[clump]]`; a particle is inside a shape if its center is.
Selection: TypeAlias = SelectionAll | SelectionBox | SelectionSphere | SelectionLayer | SelectionIds
#: Shape that is cut out of a packing.
Shape: TypeAlias = ShapeBox | ShapeCylinder | ShapeHyperboloid | ShapeMesh | ShapePeriodic
#: Side of a cylinder.
Side: TypeAlias = Literal["inside", "outside"]
#: How the force falls over the deformation.
Softening: TypeAlias = Literal["linear", "exponential"]
#: Surface of a specimen with aggregates.
Surface: TypeAlias = Literal["mould", "sawn"]
#: Weight of a contact that crosses the border of a region.
Truncation: TypeAlias = Literal["internal-only", "half-crossing", "branch-clipped"]
#: A velocity field, which prescribes the velocity of a set by its present positions.
VelocityField: TypeAlias = VelocityFieldRotation | VelocityFieldLinear
#: Surface of a wall.
WallShape: TypeAlias = WallShapePlane | WallShapeBox | WallShapeCylinder | WallShapePlate | WallShapeFacets | WallShapeMesh
#: Bound of the shear stress as a function of the normal stress. Formulas in the book.
YieldSurface: TypeAlias = Literal["mohr-coulomb", "parabolic", "logarithmic", "logarithmic-linear"]
