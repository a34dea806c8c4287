"""What a finite element code offers to a coupling, and checks that the two sides fit."""

from __future__ import annotations

from typing import Any, Callable, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._errors import CouplingError

Reals = NDArray[np.float64]


@runtime_checkable
class FiniteElements(Protocol):
    """A finite element code that advances in time under nodal forces. SI units; arrays have one row per node."""

    @property
    def nodes(self) -> Reals:
        """Reference positions, m, (n, 3)."""
        ...

    @property
    def displacement(self) -> Reals:
        """Displacements, m, (n, 3)."""
        ...

    @property
    def velocity(self) -> Reals:
        """Velocities at the half step before, m/s, (n, 3)."""
        ...

    @property
    def time_step(self) -> float:
        """Time step, s."""
        ...

    def step(self, force: ArrayLike | None = None) -> None:
        """Advance one time step under these external nodal forces, N, (n, 3)."""
        ...

    def save(self) -> Any:
        """The complete state."""
        ...

    def restore(self, state: Any) -> None:
        """Go back to a state of `save`."""
        ...


class CallbackElements:
    """Finite elements of yours, as functions.

    `step(force)` advances one time step and returns displacements (m) and velocities (m/s) of all nodes, (n, 3) each; `save()` and
    `restore(state)` are needed only by couplings that repeat steps. Results are checked: shape, finite numbers.
    """

    def __init__(
        self,
        nodes: ArrayLike,
        time_step: float,
        step: Callable[[Reals], tuple[ArrayLike, ArrayLike]],
        save: Callable[[], Any] | None = None,
        restore: Callable[[Any], None] | None = None,
    ) -> None:
        self._nodes = _vectors("nodes", nodes, None)
        if not (time_step > 0 and np.isfinite(time_step)):
            raise ValueError(f"time_step is {time_step}; it must be positive and finite")
        self._time_step = float(time_step)
        self._step, self._save, self._restore = step, save, restore
        self._displacement = np.zeros_like(self._nodes)
        self._velocity = np.zeros_like(self._nodes)

    @property
    def nodes(self) -> Reals:
        """Reference positions, m, (n, 3)."""
        return self._nodes

    @property
    def displacement(self) -> Reals:
        """Displacements, m, (n, 3)."""
        return self._displacement

    @property
    def velocity(self) -> Reals:
        """Velocities, m/s, (n, 3)."""
        return self._velocity

    @property
    def time_step(self) -> float:
        """Time step, s."""
        return self._time_step

    def step(self, force: ArrayLike | None = None) -> None:
        """Call the function with the forces, and keep what it returns."""
        count = len(self._nodes)
        load = np.zeros_like(self._nodes) if force is None else _vectors("force", force, count)
        displacement, velocity = self._step(load)
        self._displacement = _vectors("the displacement of the callback", displacement, count)
        self._velocity = _vectors("the velocity of the callback", velocity, count)

    def save(self) -> Any:
        """Displacement, velocity, and what the function `save` returns."""
        if self._save is None:
            raise CouplingError("this coupling repeats steps; give CallbackElements the functions save and restore", "NoSave")
        return self._displacement.copy(), self._velocity.copy(), self._save()

    def restore(self, state: Any) -> None:
        """Go back to a state of `save`."""
        if self._restore is None:
            raise CouplingError("this coupling repeats steps; give CallbackElements the functions save and restore", "NoSave")
        displacement, velocity, own = state
        self._displacement, self._velocity = displacement.copy(), velocity.copy()
        self._restore(own)


def _vectors(name: str, values: ArrayLike, count: int | None) -> Reals:
    """Rows of three finite numbers."""
    array = np.array(values, dtype=float)
    if array.ndim != 2 or array.shape[1] != 3 or (count is not None and len(array) != count):
        wanted = "n" if count is None else count
        raise ValueError(f"{name} has shape {array.shape}; give shape ({wanted}, 3)")
    if not np.isfinite(array).all():
        row = int(np.nonzero(~np.isfinite(array).all(axis=1))[0][0])
        raise CouplingError(f"{name} is not finite in row {row}; the finite elements have diverged: use a smaller time step", "NotFinite")
    return array


def check_scenario(simulation: Any, name: str) -> None:
    """Reject scenarios that a coupling does not support. `name`: of the coupling. Raises CouplingError for a periodic cell, for two dimensions,
    and for heat conduction, because the elements take no heat."""
    if simulation.state.cell is not None:
        raise CouplingError(f"the {name} takes specimens with a surface; remove the periodic cell", "Periodic")
    tables = simulation.scenario.to_dict()
    if tables.get("dimension", 3) == 2:
        raise CouplingError(f"the {name} takes scenarios in space; remove dimension = 2, and give elements one layer thick", "Dimension")
    if tables.get("heat") is not None:
        raise CouplingError(f"in the {name} the elements take no heat; remove [heat]", "Heat")


def check_pair(elements: FiniteElements, positions: ArrayLike, time_step: float, gap: float) -> int:
    """Whether finite elements and particles fit, and the number of particle steps per element step.

    Args: `positions` of the particles, m, (n, 3); their `time_step`, s; `gap`: distance up to which the two bodies must come near each
    other, m. Raises CouplingError if the bodies lie apart, if their sizes differ by more than 1000 (a mismatch of units), or if the
    time step of the elements is no multiple of that of the particles.
    """
    if not isinstance(elements, FiniteElements):
        raise TypeError(f"{type(elements).__name__} is no FiniteElements; give ScikitDynamics, CallbackElements, or a class with their methods")
    particles = _vectors("positions", positions, None)
    nodes = elements.nodes + elements.displacement
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    sizes = [float(np.linalg.norm(high - low)), float(np.linalg.norm(np.ptp(particles, axis=0)))]
    if min(sizes) > 0 and max(sizes) / min(sizes) > 1e3:
        message = f"the elements measure {sizes[0]:.3g} m, the particles {sizes[1]:.3g} m; give both in meters"
        raise CouplingError(message, "Units")
    apart = np.maximum(low - particles.max(axis=0), particles.min(axis=0) - high)
    distance = float(np.linalg.norm(np.maximum(apart, 0.0)))
    if distance > gap:
        raise CouplingError(f"elements and particles are {distance:.3g} m apart; move one of them, or raise gap = {gap:.3g} m", "Apart")
    ratio = elements.time_step / time_step
    steps = round(ratio)
    # The ratio of two step lengths that were computed from one another is rounded by 1e-16.
    if steps < 1 or abs(ratio - steps) > 1e-9 * steps:
        message = (
            f"the time step of the elements, {elements.time_step:.6e} s, is {ratio:.6g} times that of the particles, {time_step:.6e} s; "
            f"give the elements {max(steps, 1) * time_step:.17g} s"
        )
        raise CouplingError(message, "TimeStep")
    return steps


def cross(a: Reals, b: Reals) -> Reals:
    """Cross products of vectors in the last axis, to the bit those of ``numpy.cross``, whose checks take longer than a step of a small body."""
    ax, ay, az, bx, by, bz = a[..., 0], a[..., 1], a[..., 2], b[..., 0], b[..., 1], b[..., 2]
    x = ay * bz - az * by
    product: Reals = np.empty((*x.shape, 3))
    product[..., 0] = x
    product[..., 1] = az * bx - ax * bz
    product[..., 2] = ax * by - ay * bx
    return product
