"""Particles as a participant of preCICE 3, so that they couple with the finite elements of CalculiX, Kratos, FEniCS, code_aster, and others.

Give the participant of preCICE: ``precice.Participant("Particles", "precice-config.xml", 0, 1)`` (``pip install pyprecice``, which needs the
library of preCICE). This module does not import it.

Both participants read ``Displacement`` and write ``Force``, vectors of three on a mesh of preCICE. `SurfaceParticipant` gives the vertices of a
mesh of the scenario, `VolumeParticipant` the centers of slaves. Map displacements with ``consistent``, forces with ``conservative`` constraints.
"""

from __future__ import annotations

from os import PathLike
from typing import Any, Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import Simulation
from .._errors import CouplingError
from ._embedding import couples_of, spins_of
from ._protocol import Reals, check_scenario
from ._rescue import rescued
from ._volume import check_slaves, slave_forces, slave_rows


class _Participant:
    """The time loop. Displacements at the end of a step move the points; forces at these positions go back."""

    def __init__(
        self, simulation: Simulation, participant: Any, mesh: str, read: list[str], write: list[str], points: Reals,
        rescue: str | PathLike[str] | None,
    ) -> None:
        self.simulation = simulation
        """The particles."""
        self.participant, self.mesh = participant, mesh
        # Displacements, and data of the motion if the other code sends them.
        self._read, self._write = read, write
        self._points, self._rescue = points, rescue
        check_scenario(simulation, "coupling through preCICE")
        if (dimensions := participant.get_mesh_dimensions(mesh)) != 3:
            raise CouplingError(f'the mesh "{mesh}" of preCICE has {dimensions} dimensions; give 3', "Data")
        for name in [*read, *write]:
            if (size := participant.get_data_dimensions(mesh, name)) != 3:
                raise CouplingError(f'"{name}" of the mesh "{mesh}" has {size} components; declare data:vector', "Data")
        self._vertices = participant.set_mesh_vertices(mesh, points)
        self._displacement = np.zeros_like(points)
        self.windows = 0
        """Time windows done."""

    def _forces(self) -> list[Reals]:
        """The data to be written."""
        raise NotImplementedError

    def _step(self, displacement: Reals, motion: Reals) -> None:
        """One step to these displacements. `motion`: what the other code sends with them, or else the change of the displacements, m/s."""
        raise NotImplementedError

    def _send(self) -> None:
        for name, values in zip(self._write, self._forces(), strict=True):
            self.participant.write_data(self.mesh, name, self._vertices, values)

    def run(self) -> None:
        """Advance until preCICE ends the coupling, then finalize it.

        The time window must be a multiple of the time step of the particles. Raises CouplingError if it is not, if the other code sends numbers
        that are not finite, and if the run of the particles ends first.
        """
        participant = self.participant
        if participant.requires_initial_data():
            self._send()
        try:
            participant.initialize()
            with rescued(self._rescue, self.simulation, []) as between:
                self._windows(between)
        finally:
            # Also after an error, so that the other code does not wait.
            participant.finalize()

    def _windows(self, between: Callable[[], None]) -> None:
        """All time windows. `between`: to be called after each step."""
        participant, simulation = self.participant, self.simulation
        kept = None
        while participant.is_coupling_ongoing():
            if participant.requires_writing_checkpoint():
                kept = simulation.snapshot(), self._displacement.copy()
            step = self._advance()
            participant.advance(step)
            if participant.requires_reading_checkpoint():
                if kept is None:
                    raise CouplingError("preCICE goes back to a state that it did not ask to write", "Checkpoint")
                simulation.restore(kept[0])
                self._displacement = kept[1].copy()
            elif participant.is_time_window_complete():
                self.windows += 1
            between()

    def _advance(self) -> float:
        """One step of the particles. Returns its length, s."""
        participant, simulation = self.participant, self.simulation
        step, left = simulation.state.time_step, participant.get_max_time_step_size()
        count = round(left / step)
        # The rest of a window is a difference of times, each rounded.
        if count < 1 or abs(left / step - count) > 1e-6:
            message = (
                f"the rest of the time window, {left:.9g} s, is {left / step:.9g} steps of the particles of {step:.9g} s; fix "
                "integration.time_step, and give a time-window-size that is a multiple of it"
            )
            raise CouplingError(message, "TimeStep")
        taken = left if count == 1 else step
        displacement, *sent = [self._data(name, taken) for name in self._read]
        motion = sent[0] if sent else (displacement - self._displacement) / step
        number = simulation.state.step
        self._step(displacement, motion)
        if simulation.state.step == number:
            raise CouplingError("the run of the particles has ended; give [stop] more steps", "Stopped")
        self._displacement = displacement
        self._send()
        return float(taken)

    def _data(self, name: str, time: float) -> Reals:
        """Data at a time after the present one, s."""
        values = np.array(self.participant.read_data(self.mesh, name, self._vertices, time), dtype=float)
        if values.shape != self._points.shape:
            raise CouplingError(f'"{name}" has shape {values.shape}; the mesh "{self.mesh}" needs {self._points.shape}', "Data")
        if not np.isfinite(values).all():
            row = int(np.nonzero(~np.isfinite(values).all(axis=1))[0][0])
            raise CouplingError(f'"{name}" is not finite at vertex {row}; the other code has diverged: use a smaller time step', "NotFinite")
        return values


class SurfaceParticipant(_Participant):
    """Particles that touch the skin of the other code.

    Args:
        simulation: its scenario has a wall of the kind "mesh" without `motion`.
        participant: of preCICE, not yet initialized.
        mesh: name of the mesh of preCICE for the vertices.
        wall: name of the wall; by default the only mesh of the scenario.
        read, write: names of the displacements (m) and of the forces of the particles on the vertices (N).
        velocity: name of the velocities (m/s) with which the vertices came, in the middle of the step; by default the change of the
            displacement over the step.
        rescue: folder for the state of the particles, `particles.h5`, if a step fails, and after Ctrl-C. Default: none.

    Forces at the end of a step are those of the positions there. With initial data, serial coupling in which the elements go first, and one step
    per time window, the scheme is that of :class:`concordem.coupling.SurfaceCoupling`. In longer windows the elements take the forces of the
    end of the last one: an error of first order in the window.
    """

    def __init__(
        self, simulation: Simulation, participant: Any, mesh: str = "Particle-Mesh", wall: str | None = None, read: str = "Displacement",
        write: str = "Force", velocity: str | None = None, rescue: str | PathLike[str] | None = None,
    ) -> None:
        names = simulation.mesh_names
        if wall is None and len(names) != 1:
            raise CouplingError(f"the scenario has {len(names)} meshes, {names}; give the name of that of the skin", "Mesh")
        self.wall = names[0] if wall is None else wall
        """Name of the wall."""
        reads = [read] if velocity is None else [read, velocity]
        super().__init__(simulation, participant, mesh, reads, [write], np.array(simulation.mesh(self.wall).positions), rescue)

    def _forces(self) -> list[Reals]:
        return [np.array(self.simulation.forces(border=[]).meshes[self.wall])]

    def _step(self, displacement: Reals, motion: Reals) -> None:
        self.simulation.step(1)
        self.simulation.place_mesh(self.wall, self._points + displacement, motion)


class VolumeParticipant(_Participant):
    """Particles that follow the elements of the other code, and hand it their forces and moments.

    Displacements alone do not tell how the elements rotate at a slave, and preCICE carries forces to meshes, not moments. There are two ways;
    without one of them slaves do not spin, and their moments are lost (`lost_moment`).

    - `arm`: each slave has six more vertices, at this distance along each axis. Their displacements give its spin, and its moment becomes forces
      on them. With the places ``r_i`` of the six from their middle, their velocities ``v_i``, and
      ``T = sum of (r_i.r_i 1 - r_i r_i)``, spin and forces are ``w = T^-1 sum of r_i x v_i`` and ``f_i = T^-1 M x r_i``. So
      ``sum of f_i = 0``, ``sum of r_i x f_i = M``, and ``sum of f_i.v_i = M.w``. The other code needs nothing new. Its elements must reach as far,
      and the mapping must interpolate within them, such as by the nearest projection.
    - `angular_velocity` and `moment`: data that the other code reads and writes, for one with shape functions at the slaves or with rotations
      at its nodes: angular velocities of its elements in the middle of the step, ``w = 1/2 sum of grad N_a x v_a``, rad/s; and moments on them,
      ``f_a = 1/2 M x grad N_a``, N m. See :class:`concordem.coupling.Embedding`.

    Args:
        simulation: its scenario prescribes all velocities and angular velocities of the slaves, as zero.
        participant: of preCICE, not yet initialized.
        slaves: ids of the slaves.
        mesh, read, write: see :class:`SurfaceParticipant`; the vertices are the slaves, by ascending id, then the six of each slave.
        arm: distance of the further vertices, m; not larger than the elements.
        angular_velocity, moment: names of these data.
        rescue: see :class:`SurfaceParticipant`.

    Raises CouplingError in the first step if something else moves a slave; ValueError for both ways at once, or half of one.
    """

    def __init__(
        self, simulation: Simulation, participant: Any, slaves: ArrayLike, mesh: str = "Particle-Mesh", read: str = "Displacement", write: str = "Force",
        arm: float | None = None, angular_velocity: str | None = None, moment: str | None = None, rescue: str | PathLike[str] | None = None,
    ) -> None:
        self.slaves: NDArray[np.int64] = np.unique(np.asarray(slaves))
        """Ids of the slaves, ascending."""
        self.lost_moment = 0.0
        """Largest size of the sum of those moments on the slaves about their centers that do not reach the other code, N m."""
        if (angular_velocity is None) != (moment is None) or (arm is not None and moment is not None):
            raise ValueError("give either arm, or both angular_velocity and moment, or none of the three")
        if arm is not None and not (arm > 0 and np.isfinite(arm)):
            raise ValueError(f"arm is {arm}; it must be positive and finite")
        check_slaves(simulation.state, self.slaves)
        self._centers: Reals = np.array(simulation.state.positions)[slave_rows(simulation.state, self.slaves)]
        self._arm = arm
        points = self._centers
        if arm is not None:
            star = arm * np.concatenate([np.eye(3), -np.eye(3)])
            points = np.concatenate([points, (points[:, None, :] + star).reshape(-1, 3)])
        more = [] if angular_velocity is None else [angular_velocity]
        super().__init__(simulation, participant, mesh, [read, *more], [write] + ([] if moment is None else [moment]), points, rescue)

    def _stars(self) -> Reals:
        """Places of the six further vertices of each slave, m, (k, 6, 3)."""
        count = len(self.slaves)
        return (self._points + self._displacement)[count:].reshape(count, 6, 3)

    def _forces(self) -> list[Reals]:
        force, moment = slave_forces(self.simulation, self.slaves)
        if self._arm is not None:
            return [np.concatenate([force, couples_of(self._stars(), moment).reshape(-1, 3)])]
        if len(self._write) == 2:
            return [force, moment]
        self.lost_moment = max(self.lost_moment, float(np.linalg.norm(moment.sum(axis=0))))
        return [force]

    def _spins(self, motion: Reals) -> Reals:
        """Angular velocities of the slaves in the coming step, rad/s."""
        if self._arm is not None:
            stars = self._stars()
            return spins_of(stars, motion[len(self.slaves) :].reshape(stars.shape))
        return motion if len(self._read) == 2 else np.zeros_like(self._centers)

    def _step(self, displacement: Reals, motion: Reals) -> None:
        simulation = self.simulation
        state = simulation.state
        rows = slave_rows(state, self.slaves)
        wanted = self._centers + displacement[: len(rows)]
        # To the place, and not by the velocity, so that rounding does not add up.
        targets = np.array(state.velocities)
        targets[rows] = (wanted - np.array(state.positions)[rows]) / state.time_step
        spins = np.array(state.angular_velocities)
        spins[rows] = self._spins(motion)
        simulation.set_motion(targets, spins)
        wanted_spins = spins[rows]
        simulation.step(1)
        rows = slave_rows(simulation.state, self.slaves)
        turned = np.array(simulation.state.angular_velocities)[rows]
        if not np.allclose(turned, wanted_spins, rtol=1e-9, atol=0.0):
            worst = int(self.slaves[int(np.argmax(np.abs(turned - wanted_spins).max(axis=1)))])
            message = f"slave {worst} does not rotate with its element; prescribe its angular_velocity as [0, 0, 0]"
            raise CouplingError(message, "Slaves")
        gap = np.linalg.norm(simulation.state.positions[rows] - wanted, axis=1)
        # Positions are rounded by 1e-16 of their size.
        if gap.max() > 1e-9 * np.abs(wanted).max():
            worst = int(np.argmax(gap))
            message = (
                f"slave {self.slaves[worst]} is {gap[worst]:.3g} m away from its place; prescribe all velocities and angular velocities of the "
                "slaves as zero, without histories"
            )
            raise CouplingError(message, "Slaves")
