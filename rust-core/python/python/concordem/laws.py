"""Contact laws written in Python, to try an idea before it becomes Rust.

A law is a class derived from :class:`Law`. The solver calls its method ``respond`` with many contacts at a time, as NumPy arrays, and
does the rest: motion, torques, neighbors, time step, energy ledger, restart.

>>> import numpy as np
>>> import concordem
>>> from concordem.laws import Law, Response
>>> class Spring(Law):
...     '''A bond that breaks at a tensile force.'''
...     def __init__(self, stiffness, strength):
...         self.k, self.strength = stiffness, strength
...     def stiffness(self, geometry):
...         return self.k, 0.0
...     def respond(self, contacts):
...         force = self.k * contacts.elongation
...         return Response(force, broken=force > self.strength)
>>> scenario = concordem.Scenario(
...     packing={"kind": "spheres", "spheres": [[0, 0, 0, "1 mm"], ["2 mm", 0, 0, "1 mm"]]},
...     material={"name": "glass", "density": "2500 kg/m^3",
...               "linear_bond": {"normal_stiffness": "1e6 N/m", "shear_stiffness": "3e5 N/m"}},
...     bonds={"law": "linear_bond", "interaction_ratio": 1.1}, contacts={"law": "none"}, stop={"steps": 100},
... )
>>> simulation = scenario.simulation(bond_law=Spring(1e6, 10.0))
>>> simulation.state.writable("velocities")[1, 0] = 1e-3
>>> simulation.run()
'steps'

Expect some 2 us per bond and step in large specimens, and 50 us per step in small ones; Python runs in one thread at a time. For the law in
Rust see the tutorial "Write your own law"; the formulas of ``respond`` carry over line by line.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, Mapping, NamedTuple, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core

Reals = NDArray[np.float64]

_VECTORS, _SCALARS = 3, 4
_ENERGIES = ("stored_normal", "stored_shear", "damage", "friction", "viscous", "integration")


class Geometry(NamedTuple):
    """What never changes in a contact, n contacts. With walls, `radius_b` is 0 and `mass_b` infinite."""

    reference_length: Reals
    """Center distance without load, m, (n,)."""
    area: Reals
    """Cross-section, m^2, (n,)."""
    radius_a: Reals
    """Radius of A, m, (n,)."""
    radius_b: Reals
    """Radius of B, m, (n,)."""
    mass_a: Reals
    """Mass of A, kg, (n,)."""
    mass_b: Reals
    """Mass of B, kg, (n,)."""
    materials: NDArray[np.uint16]
    """Materials of A and B, in the order of the scenario, from 0, (n, 2)."""


class Contacts(NamedTuple):
    """n contacts at the end of a step."""

    geometry: Geometry
    """What never changes."""
    bonded: NDArray[np.bool_]
    """Whether the contact is a bond, (n,)."""
    length: Reals
    """Center distance, m, (n,)."""
    length_old: Reals
    """Center distance one step ago, m, (n,)."""
    elongation: Reals
    """`length - reference_length`, m, positive in tension, (n,)."""
    elongation_old: Reals
    """Elongation one step ago, m, (n,)."""
    gap: Reals
    """Distance of the surfaces, m, negative when they overlap, (n,)."""
    normal: Reals
    """Unit vector from A to B, (n, 3)."""
    shear_increment: Reals
    """Tangential displacement of B relative to A in this step, m, (n, 3)."""
    time_step: float
    """Duration of the step, s."""
    history: Mapping[str, Reals]
    """What the law returned as history one step ago; zero at first. Vectors have been rotated with the contact."""


@dataclass(frozen=True)
class Response:
    """What a law answers. Numbers stand for arrays of equal numbers."""

    normal_force: ArrayLike
    """Normal force, N, positive in tension, (n,)."""
    shear_force: ArrayLike = 0.0
    """Shear force on A, N, tangential, (n, 3). A spring pulls A with B: `stiffness * slip of B relative to A`."""
    history: Mapping[str, ArrayLike] = field(default_factory=dict)
    """New history by name; a name that is missing keeps its values."""
    broken: ArrayLike = False
    """Bonds that break in this step, (n,). Their forces no longer act."""
    opened: ArrayLike = False
    """Contacts without a bond that are open, (n,). They lose force and history."""
    energy: Mapping[str, ArrayLike] | None = None
    """Energies by name, J, (n,): ``stored_normal`` and ``stored_shear`` now; ``damage``, ``friction``, and ``viscous`` dissipated in this
    step; ``integration``, the error of the trapezoidal rule at a kink. None: the work done on a contact counts as stored, and is dissipated
    when the contact ends."""


class Law(abc.ABC):
    """A contact law for particles that exert forces, without moments, on each other at a contact point.

    Use it with ``scenario.simulation(bond_law=...)`` or ``contact_law=...``. The scenario needs a law in its place, which provides the
    density, the area, and the reference length. Laws in Python do not deform particles, and calibration and the program do not know
    them. Keep `respond` free of side effects: blocks of contacts come in any order.
    """

    history: ClassVar[Mapping[str, Literal["scalar", "vector"]]] = {}
    """Names of the history: at most 3 vectors, tangential ones such as slip, and 4 scalars."""

    @abc.abstractmethod
    def stiffness(self, geometry: Geometry) -> Sequence[ArrayLike]:
        """Largest stiffness, for the time step: normal and shear (N/m), and optionally the normal and shear dashpots (N s/m)."""

    @abc.abstractmethod
    def respond(self, contacts: Contacts) -> Response:
        """Forces at the end of a step."""


@dataclass(frozen=True)
class Conformance:
    """What the conformance suite found."""

    passed: bool
    """Whether the law has all properties."""
    report: str
    """One line per check: verdict, figure, bound, reason."""


def check(
    law: Law,
    *,
    bonded: bool = True,
    reference_length: float = 2.0,
    area: float = 1.0,
    radii: tuple[float, float] = (0.8, 1.2),
    masses: tuple[float, float] = (1.0, 2.0),
    elastic: tuple[float, float, float],
    inelastic: tuple[float, float, float] | None = None,
    held: tuple[float, float, float],
    failure: float,
    time_step: float = 1e-3,
    conservative_normal: bool = True,
    conservative_shear: bool = True,
    dissipation_nonnegative: bool = True,
    continuous_failure: bool = True,
    brittle: bool = False,
) -> Conformance:
    """Run the conformance suite of the laws in Rust: objectivity, exchange of the particles, energy balance, extremes, and claims.

    ``elastic`` and ``inelastic`` (default: the same): elongations from and to, and the largest shear displacement, m; the claims hold in
    the first, and those that are False are violated in the second. ``held``: an elongation and two shear displacements at which the
    contact stays, m. ``failure``: an elongation at which the contact has failed or opened, m. The energy balance needs the energies of
    :class:`Response`; without them it holds by construction.
    """
    geometry = (reference_length, area, *radii, *masses)
    claims = (conservative_normal, conservative_shear, dissipation_nonnegative, continuous_failure, brittle)
    return Conformance(*_core._law_conformance(law, bonded, geometry, elastic, inelastic or elastic, held, failure, time_step, claims))


def _names(law: Law) -> tuple[list[str], list[str]]:
    """Names of the vectors and scalars of a law's history."""
    kinds = {"vector": _VECTORS, "scalar": _SCALARS}
    found: dict[str, list[str]] = {kind: [] for kind in kinds}
    for name, kind in law.history.items():
        if kind not in kinds:
            raise ValueError(f"{type(law).__name__}.history[{name!r}] is {kind!r}; give 'scalar' or 'vector'")
        found[kind].append(name)
    for name, most in kinds.items():
        if len(found[name]) > most:
            raise ValueError(f"{type(law).__name__}.history has {len(found[name])} {name}s; at most {most} are possible")
    return found["vector"], found["scalar"]


def _history(law: Law) -> str:
    """What a law remembers, in the order of the places in which the solver keeps it."""
    vectors, scalars = _names(law)
    return f"{{{', '.join([*(f'{name}: vector' for name in vectors), *(f'{name}: scalar' for name in scalars)])}}}"


def _array(law: Law, what: str, values: Any, shape: tuple[int, ...], kind: type = float) -> NDArray[Any]:
    """`values` as an array of this shape, or an error that names the law and the value."""
    try:
        # Most arrays are as they should be, and `broadcast_to` is slow.
        array: NDArray[Any] = np.ascontiguousarray(values, kind)
        if array.shape != shape:
            array = np.ascontiguousarray(np.broadcast_to(np.asarray(values, kind), shape))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{type(law).__name__}: {what} has shape {np.shape(values)}; give shape {shape}") from error
    if kind is float and not np.isfinite(array).all():
        raise ValueError(f"{type(law).__name__}: {what} is {array[~np.isfinite(array)][0]} in a contact; give finite numbers")
    return array


def _stiffness(law: Law, geometry: list[Any], materials: NDArray[np.uint16]) -> Reals:
    """Stiffnesses as the solver reads them."""
    of = Geometry._make([*geometry, materials])
    answer = law.stiffness(of)
    if not isinstance(answer, Sequence) or not 2 <= len(answer) <= 4:
        raise TypeError(f"{type(law).__name__}.stiffness returned {answer!r}; return the normal and the shear stiffness, N/m")
    n = len(of.area)
    columns = [_array(law, "a stiffness", values, (n,)) for values in (*answer, 0.0, 0.0)][:4]
    if min((column.min() for column in columns if n), default=0.0) < 0:
        raise ValueError(f"{type(law).__name__}: a stiffness is negative")
    return np.stack(columns, 1).ravel()


class _Answer(NamedTuple):
    """What the solver reads."""

    normal_force: Reals
    shear_force: Reals
    vectors: list[Reals]
    scalars: list[Reals]
    status: Reals
    energy: Reals | None


def _respond(law: Law, moved: tuple[Any, ...], vectors: list[Reals], scalars: list[Reals]) -> _Answer:
    """Call a law, and check what it returns."""
    geometry, materials, bonded, *rest, step = moved
    vector_names, scalar_names = _names(law)
    history = {**dict(zip(vector_names, vectors)), **dict(zip(scalar_names, scalars))}
    answer = law.respond(Contacts._make([Geometry._make([*geometry, materials]), bonded, *rest, step, history]))
    name = type(law).__name__
    if not isinstance(answer, Response):
        raise TypeError(f"{name}.respond returned {type(answer).__name__}; return a concordem.laws.Response")
    n = len(bonded)
    if unknown := set(answer.history) - set(history):
        raise ValueError(f"{name}: {sorted(unknown)[0]!r} is no name of its history; declare it in {name}.history")
    if unknown := set(answer.energy or ()) - set(_ENERGIES):
        raise ValueError(f"{name}: {sorted(unknown)[0]!r} is no energy; the energies are {', '.join(_ENERGIES)}")
    for k, key in enumerate(vector_names):
        if key in answer.history:
            vectors[k] = _array(law, f"history {key!r}", answer.history[key], (n, 3))
    for k, key in enumerate(scalar_names):
        if key in answer.history:
            scalars[k] = _array(law, f"history {key!r}", answer.history[key], (n,))
    normal_force = _array(law, "normal_force", answer.normal_force, (n,))
    shear_force = _array(law, "shear_force", answer.shear_force, (n, 3))
    energy = None
    if answer.energy is not None:
        table = np.zeros((n, len(_ENERGIES)))
        for k, key in enumerate(_ENERGIES):
            if key in answer.energy:
                table[:, k] = _array(law, f"energy {key!r}", answer.energy[key], (n,))
        energy = table.ravel()
    status = np.zeros(n)
    if answer.broken is not False or answer.opened is not False:
        broken, opened = (_array(law, what, getattr(answer, what), (n,), bool) for what in ("broken", "opened"))
        if (broken & ~bonded).any():
            raise ValueError(f"{name}: a contact without a bond is broken; say that it is opened")
        if (opened & bonded).any():
            raise ValueError(f"{name}: a bond is opened; say that it is broken")
        ends = broken | opened
        normal_force, shear_force = np.where(ends, 0.0, normal_force), np.where(ends[:, None], 0.0, shear_force)
        status = broken + 2.0 * opened
    return _Answer(normal_force, shear_force, vectors, scalars, status, energy)
