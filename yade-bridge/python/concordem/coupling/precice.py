"""Particles as a participant of preCICE 3, so that they couple with the finite elements of CalculiX, Kratos, FEniCS, code_aster, and others.

Give the participant of preCICE: ``precice.Participant("Particles", "precice-config.xml", 0, 1)`` (``pip install pyprecice``, which needs the
library of preCICE). This module does not import it.

Both participants read ``Displacement`` and write ``Force``, vectors of three on a mesh of preCICE. `SurfaceParticipant` gives the vertices of a
mesh of the scenario, `VolumeParticipant` the centers of slaves. Map displacements with ``consistent``, forces with ``conservative`` constraints.
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import Simulation
from .._errors import CouplingError
from ._protocol import Reals
from ._volume import check_slaves, slave_forces, slave_rows


class _Participant:
    """The time loop. Displacements at the end of a step move the points; forces at these positions go back."""

    def __init__(self, simulation: Simulation, participant: Any, mesh: str, read: str, write: str, velocity: str | None, points: Reals) -> None:
        self.simulation = simulation
        """The particles. An implicit coupling replaces it when it goes back."""
        self.participant, self.mesh = participant, mesh
        self._read, self._write, self._velocity = read, write, velocity
        self._points = points
        if simulation.state.cell is not None:
            raise CouplingError("this coupling takes specimens with a surface; remove the periodic cell", "Periodic")
        if (dimensions := participant.get_mesh_dimensions(mesh)) != 3:
            raise CouplingError(f'the mesh "{mesh}" of preCICE has {dimensions} dimensions; give 3', "Data")
        for name in [read, write, *([velocity] if velocity else [])]:
            if (size := participant.get_data_dimensions(mesh, name)) != 3:
                raise CouplingError(f'"{name}" of the mesh "{mesh}" has {size} components; declare data:vector', "Data")
        self._vertices = participant.set_mesh_vertices(mesh, points)
        self._displacement = np.zeros_like(points)
        self.windows = 0
        """Time windows done."""

    def _forces(self) -> Reals:
        raise NotImplementedError

    def _step(self, displacement: Reals, velocity: Reals) -> None:
        raise NotImplementedError

    def run(self) -> None:
        """Advance until preCICE ends the coupling, then finalize it.

        The time window must be a multiple of the time step of the particles. Raises CouplingError if it is not, if the other code sends numbers
        that are not finite, and if the run of the particles ends first.
        """
        participant = self.participant
        if participant.requires_initial_data():
            participant.write_data(self.mesh, self._write, self._vertices, self._forces())
        try:
            participant.initialize()
            with TemporaryDirectory() as folder:
                self._windows(Path(folder) / "window.h5")
        finally:
            # Also after an error, so that the other code does not wait.
            participant.finalize()

    def _windows(self, checkpoint: Path) -> None:
        """All time windows; `checkpoint` is the file of the state at the start of one."""
        participant = self.participant
        kept: Reals | None = None
        while participant.is_coupling_ongoing():
            if participant.requires_writing_checkpoint():
                self.simulation.save(checkpoint)
                kept = self._displacement.copy()
            step = self._advance()
            participant.advance(step)
            if participant.requires_reading_checkpoint():
                if kept is None:
                    raise CouplingError("preCICE goes back to a state that it did not ask to write", "Checkpoint")
                self.simulation, self._displacement = Simulation.load(checkpoint), kept.copy()
            elif participant.is_time_window_complete():
                self.windows += 1

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
        displacement = self._data(self._read, taken)
        moved = (displacement - self._displacement) / step
        velocity = moved if self._velocity is None else self._data(self._velocity, taken)
        number = simulation.state.step
        self._step(displacement, velocity)
        if simulation.state.step == number:
            raise CouplingError("the run of the particles has ended; give [stop] more steps", "Stopped")
        self._displacement = displacement
        participant.write_data(self.mesh, self._write, self._vertices, self._forces())
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

    Forces at the end of a step are those of the positions there. With initial data, serial coupling in which the elements go first, and one step
    per time window, the scheme is that of :class:`concordem.coupling.SurfaceCoupling`. In longer windows the elements take the forces of the
    end of the last one: an error of first order in the window.
    """

    def __init__(
        self, simulation: Simulation, participant: Any, mesh: str = "Particle-Mesh", wall: str | None = None, read: str = "Displacement",
        write: str = "Force", velocity: str | None = None,
    ) -> None:
        names = simulation.mesh_names
        if wall is None and len(names) != 1:
            raise CouplingError(f"the scenario has {len(names)} meshes, {names}; give the name of that of the skin", "Mesh")
        self.wall = names[0] if wall is None else wall
        """Name of the wall."""
        super().__init__(simulation, participant, mesh, read, write, velocity, np.array(simulation.mesh(self.wall).positions))

    def _forces(self) -> Reals:
        forces: Reals = np.array(self.simulation.forces(border=[]).meshes[self.wall])
        return forces

    def _step(self, displacement: Reals, velocity: Reals) -> None:
        self.simulation.step(1)
        self.simulation.place_mesh(self.wall, self._points + displacement, velocity)


class VolumeParticipant(_Participant):
    """Particles that follow the elements of the other code, and hand it their forces.

    Args:
        simulation: its scenario prescribes all velocities and angular velocities of the slaves, as zero.
        participant: of preCICE, not yet initialized.
        slaves: ids of the slaves.
        mesh, read, write: see :class:`SurfaceParticipant`; the vertices are the slaves, by ascending id.

    Raises CouplingError in the first step if something else moves a slave. Displacements do not tell how the elements rotate: slaves do not spin. Moments on them have no counterpart in the other code;
    `lost_moment` has the largest sum of them. Where it counts, use :class:`concordem.coupling.VolumeCoupling`.
    """

    def __init__(
        self, simulation: Simulation, participant: Any, slaves: ArrayLike, mesh: str = "Particle-Mesh", read: str = "Displacement", write: str = "Force",
    ) -> None:
        self.slaves: NDArray[np.int64] = np.unique(np.asarray(slaves))
        """Ids of the slaves, ascending."""
        self.lost_moment = 0.0
        """Largest size of the sum of the moments on the slaves about their centers, N m: it does not reach the other code."""
        check_slaves(simulation.state, self.slaves)
        points = np.array(simulation.state.positions)[slave_rows(simulation.state, self.slaves)]
        super().__init__(simulation, participant, mesh, read, write, None, points)

    def _forces(self) -> Reals:
        force, moment = slave_forces(self.simulation, self.slaves)
        self.lost_moment = max(self.lost_moment, float(np.linalg.norm(moment.sum(axis=0))))
        return force

    def _step(self, displacement: Reals, velocity: Reals) -> None:
        simulation = self.simulation
        state = simulation.state
        rows = slave_rows(state, self.slaves)
        # To the place, and not by the velocity, so that rounding does not add up.
        targets = np.array(state.velocities)
        targets[rows] = (self._points + displacement - np.array(state.positions)[rows]) / state.time_step
        spins = np.array(state.angular_velocities)
        spins[rows] = 0.0
        simulation.set_motion(targets, spins)
        simulation.step(1)
        wanted = self._points + displacement
        gap = np.linalg.norm(simulation.state.positions[slave_rows(simulation.state, self.slaves)] - wanted, axis=1)
        # Positions are rounded by 1e-16 of their size.
        if gap.max() > 1e-9 * np.abs(wanted).max():
            worst = int(np.argmax(gap))
            message = (
                f"slave {self.slaves[worst]} is {gap[worst]:.3g} m away from its place; prescribe all velocities and angular velocities of the "
                "slaves as zero, without histories"
            )
            raise CouplingError(message, "Slaves")
