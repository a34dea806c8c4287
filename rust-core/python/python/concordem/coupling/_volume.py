"""Volume coupling: particles in the overlap move with the elements and hand their forces to the nodes."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._errors import CouplingError
from ._embedding import Embedding, _cells_of
from ._protocol import FiniteElements, Reals, _vectors, check_pair, check_scenario, cross
from ._record import MotionRecord, written
from ._rescue import rescued

if TYPE_CHECKING:
    from .._core import Simulation

# Clump of a particle that belongs to none.
_NO_CLUMP = 2**32 - 1


class Exchange(NamedTuple):
    """What the last exchange passed from the slaves to the nodes, and what it lost: rounding."""

    force: Reals
    """Sum of the forces, N, (3,)."""
    moment: Reals
    """Sum of the moments about the origin, N m, (3,)."""
    work: float
    """Work of the forces on the nodes during the step, J."""
    lost_force: Reals
    """Sum on the slaves minus sum on the nodes, N, (3,)."""
    lost_moment: Reals
    """The same for the moments, N m, (3,)."""
    lost_work: float
    """The same for the work, J."""


def check_slaves(state: Any, slaves: NDArray[np.int64]) -> None:
    """Raises ValueError for no ids and for what is no id, CouplingError for ids that do not exist and for members of clumps."""
    if slaves.size == 0 or not np.issubdtype(slaves.dtype, np.integer):
        raise ValueError("slaves must be the ids of one particle or more")
    missing = np.setdiff1d(slaves, state.ids)
    if missing.size:
        raise CouplingError(f"there is no particle with the id {missing[0]}; give ids of state.ids", "Slaves")
    clumped = state.clumps[slave_rows(state, slaves)] != _NO_CLUMP
    if clumped.any():
        raise CouplingError(f"slave {slaves[np.nonzero(clumped)[0][0]]} belongs to a clump; slaves are single spheres", "Clumps")


def slave_rows(state: Any, slaves: NDArray[np.int64]) -> NDArray[np.int64]:
    """Rows of the slaves with these ascending ids in the state, which may sort its particles anew."""
    ids = state.ids
    order = np.argsort(ids)
    rows: NDArray[np.int64] = order[np.searchsorted(ids, slaves, sorter=order)]
    return rows


def slave_forces(simulation: Simulation, slaves: NDArray[np.int64]) -> tuple[Reals, Reals]:
    """Forces (N) and moments about the centers (N m) of other particles on the slaves at the present instant, (k, 3) each. Raises
    CouplingError if a wall touches a slave."""
    rows = slave_rows(simulation.state, slaves)
    # Only contacts between slaves and others are evaluated.
    state, forces = simulation.state, simulation.forces(border=rows)
    number = np.full(len(state), -1)
    number[rows] = np.arange(len(slaves))
    if (number[forces.walls.particle] >= 0).any():
        row = int(forces.walls.particle[number[forces.walls.particle] >= 0][0])
        raise CouplingError(f"a wall touches slave {state.ids[row]}; load the elements instead, or move the wall", "Walls")
    contacts, positions = forces.contacts, state.positions
    side = number[contacts.pair]
    force, moment = np.zeros((len(slaves), 3)), np.zeros((len(slaves), 3))
    for end, sign in [(0, 1.0), (1, -1.0)]:
        chosen = side[:, end] >= 0
        pull = sign * contacts.force[chosen]
        couple = cross(contacts.point[chosen] - positions[contacts.pair[chosen, end]], pull)
        if contacts.moment is not None:
            couple += sign * contacts.moment[chosen]
        np.add.at(force, side[chosen, end], pull)
        np.add.at(moment, side[chosen, end], couple)
    return force, moment


class VolumeCoupling:
    """Particles that are slaves of finite elements: the elements continue where the particles end.

    Slaves have the velocity and the spin of their element (see :class:`Embedding`). Forces and moments between slaves and other
    particles go to the nodes. Contacts between two slaves do not count: in the overlap, stiffness and mass are those of the elements.

    Both sides advance from the same instant: forces of the positions at t accelerate particles and nodes alike, so their momentum and
    angular momentum together change only by other loads. The scenario prescribes all six velocities of the slaves, as zero.

    Args:
        simulation: without a periodic cell.
        elements: the time step must be that of the particles.
        slaves: ids of the slaves.
        cells: elements as nodes numbered as in VTK, (m, 4) or (m, 8); by default those of `elements.mesh`.
        reference: places of the slaves in the reference configuration, by ascending id, m, (k, 3). Default: where they are, for elements
            not yet deformed. To continue a saved run, restore both sides and give the attribute `reference` of the first coupling;
            `rescue` writes it to `reference.npy`.
        record: name of the set of the slaves in the scenario, to record their motion for :meth:`write_motion`; from step 0 on.
        rescue: folder for the states of both sides if a step fails, and after Ctrl-C; the error then has a note that names the files.
            `restore_elements` reads those of the elements. Default: none.

    Raises CouplingError for pairs that do not fit, slaves outside the elements, slaves of clumps, walls that touch a slave, and slaves
    that do not follow.
    """

    def __init__(
        self,
        simulation: Simulation,
        elements: FiniteElements,
        slaves: ArrayLike,
        cells: ArrayLike | None = None,
        reference: ArrayLike | None = None,
        record: str | None = None,
        rescue: str | PathLike[str] | None = None,
    ) -> None:
        state = simulation.state
        check_scenario(simulation, "volume coupling")
        self.simulation, self.elements = simulation, elements
        self.slaves = np.unique(np.asarray(slaves))
        """Ids of the slaves, ascending."""
        check_slaves(state, self.slaves)
        rows = self._rows()
        if check_pair(elements, state.positions[rows], state.time_step, 0.0) != 1:
            message = f"the elements must have the time step of the particles; give them {state.time_step:.17g} s"
            raise CouplingError(message, "TimeStep")
        table = _cells_of(elements) if cells is None else cells
        places = state.positions[rows] if reference is None else _vectors("reference", reference, len(rows))
        self.reference: Reals = places.copy()
        """Places of the slaves in the reference configuration, m, (k, 3)."""
        self.embedding = Embedding(elements.nodes, table, self.reference)
        """The slaves in the elements, in the order of `slaves`."""
        self._check_places()
        self.work = 0.0
        """Work of the slaves on the elements so far, J."""
        self.last: Exchange | None = None
        """The last exchange."""
        self._rescue = rescue
        self._record = None if record is None else MotionRecord(state.step)
        self._set = record or ""
        if self._record is not None:
            self._record.add("set", self._set, state.velocities[rows], state.angular_velocities[rows])

    def _rows(self) -> NDArray[np.int64]:
        """Rows of the slaves in the state, which may sort its particles anew."""
        return slave_rows(self.simulation.state, self.slaves)

    def _check_places(self) -> None:
        """Whether the slaves are where their elements are."""
        places = self.embedding.positions(self.elements.displacement)
        gap = np.linalg.norm(self.simulation.state.positions[self._rows()] - places, axis=1)
        size = float(np.ptp(self.elements.nodes, axis=0).max())
        # Positions are sums of up to 1e7 steps, each rounded by 1e-16 of the size.
        if gap.max() > 1e-9 * size:
            worst = int(np.argmax(gap))
            message = (
                f"slave {self.slaves[worst]} is {gap[worst]:.3g} m away from its place in element {self.embedding.element[worst]}; "
                "prescribe all velocities and angular velocities of the slaves as zero, without histories, and move the nodes only by steps "
                "of this coupling"
            )
            raise CouplingError(message, "Slaves")

    def forces(self) -> tuple[Reals, Reals]:
        """Forces (N) and moments (N m) of other particles on the slaves at the present instant, (k, 3) each."""
        return slave_forces(self.simulation, self.slaves)

    def step(self, count: int = 1, load: ArrayLike | None = None, motion: tuple[ArrayLike, ArrayLike] | None = None) -> None:
        """Advance both sides by `count` steps, under further forces `load` on the nodes, N, (n, 3).

        `motion`: velocities (m/s) and angular velocities (rad/s) of other prescribed particles, one row per particle of the state, as in
        `Simulation.set_motion`; by default they keep theirs.
        """
        elements = self.elements
        outer = np.zeros_like(elements.nodes) if load is None else _vectors("load", load, len(elements.nodes))
        with rescued(self._rescue, self.simulation, [self.elements], {"reference": self.reference}) as between:
            for _ in range(count):
                self._advance(outer, motion)
                between()

    def _advance(self, outer: Reals, motion: tuple[ArrayLike, ArrayLike] | None) -> None:
        """One step."""
        elements, embedding, simulation = self.elements, self.embedding, self.simulation
        dt = simulation.state.time_step
        if abs(dt - elements.time_step) > 1e-9 * dt:
            raise CouplingError(f"the time step of the particles has become {dt:.6e} s; fix integration.time_step", "TimeStep")
        if simulation.stopped is not None:
            raise CouplingError("the run of the particles has ended; give [stop] more steps", "Stopped")
        displacement, before = elements.displacement, elements.velocity.copy()
        gradients = embedding.gradients(displacement)
        force, moment = self.forces()
        nodal = embedding.distribute(force, moment, gradients)
        present = elements.nodes + displacement
        elements.step(outer + nodal)
        velocity, spin = embedding.motion(elements.velocity, gradients)
        # Forces at an instant work over the half steps before and after it.
        path = 0.5 * dt * (before + elements.velocity)
        shift, turn = embedding.motion(path, gradients)
        work = float(np.vdot(nodal, path))
        places = embedding.positions(displacement)
        total, couple = nodal.sum(axis=0), cross(present, nodal).sum(axis=0)
        self.last = Exchange(
            total, couple, work, force.sum(axis=0) - total, (cross(places, force) + moment).sum(axis=0) - couple,
            float(np.vdot(force, shift) + np.vdot(moment, turn)) - work,
        )
        self.work += work
        rows = self._rows()
        # A prescribed particle has the velocity of its target; those of free particles have no effect.
        state = simulation.state
        others = (state.velocities, state.angular_velocities) if motion is None else motion
        targets, spins = (_vectors("motion", values, len(state)) for values in others)
        targets[rows], spins[rows] = velocity, spin
        simulation.set_motion(targets, spins)
        simulation.step(1)
        if self._record is not None:
            self._record.add("set", self._set, velocity, spin)
        turned = simulation.state.angular_velocities[self._rows()]
        if not np.allclose(turned, spin, rtol=1e-9, atol=0.0):
            worst = int(self.slaves[int(np.argmax(np.abs(turned - spin).max(axis=1)))])
            message = f"slave {worst} does not rotate with its element; prescribe its angular_velocity as [0, 0, 0]"
            raise CouplingError(message, "Slaves")
        self._check_places()

    def write_motion(self, folder: str | PathLike[str]) -> list[dict[str, Any]]:
        """Write the recorded motion to the folder; returns the tables ``[[slave]]`` with which a scenario in that folder repeats the run
        without finite elements, to the bit."""
        return written(self._record, folder)
