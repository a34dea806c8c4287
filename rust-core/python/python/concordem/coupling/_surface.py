"""Surface coupling: the skin of the elements is a mesh that particles touch."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._errors import CouplingError
from ._embedding import _cells_of
from ._protocol import FiniteElements, Reals, _vectors, check_scenario, cross
from ._record import MotionRecord, written
from ._rescue import rescued

if TYPE_CHECKING:
    from .._core import Simulation

# Faces of cells with the nodes numbered as in VTK.
_FACES: dict[int, list[tuple[int, ...]]] = {
    4: [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)],
    8: [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
}


class Skin:
    """The outer faces of elements as triangles.

    Args: `elements`; `cells`: elements as nodes numbered as in VTK, (m, 4) or (m, 8), by default those of `elements.mesh`; `where`: only
    faces whose nodes are all chosen, booleans (n,). A quadrilateral becomes two triangles.
    """

    def __init__(self, elements: FiniteElements, cells: ArrayLike | None = None, where: ArrayLike | None = None) -> None:
        table = np.asarray(_cells_of(elements) if cells is None else cells)
        if table.ndim != 2 or table.shape[1] not in _FACES:
            raise ValueError(f"cells have shape {table.shape}; the skin needs tetrahedra (m, 4) or hexahedra (m, 8)")
        shapes = _FACES[table.shape[1]]
        faces = np.concatenate([table[:, face] for face in shapes])
        # A face of two elements is inside.
        _, place, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        outside = np.sort(place[count == 1])
        outer = faces[outside]
        # Meshes may number their cells as mirror images: turn the faces outwards.
        middle = elements.nodes[table].mean(axis=1)[outside % len(table)]
        corners = elements.nodes[outer]
        normal = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        inward = np.einsum("fi,fi->f", normal, corners.mean(axis=1) - middle) < 0
        outer[inward] = outer[inward][:, ::-1]
        if where is not None:
            chosen = np.asarray(where, dtype=bool)
            if chosen.shape != (len(elements.nodes),):
                raise ValueError(f"where has shape {chosen.shape}; give one boolean per node, ({len(elements.nodes)},)")
            outer = outer[chosen[outer].all(axis=1)]
        if len(outer) == 0:
            raise CouplingError("no outer face is chosen; the skin would be empty", "Skin")
        if outer.shape[1] == 4:
            outer = np.concatenate([outer[:, [0, 1, 2]], outer[:, [0, 2, 3]]])
        self.nodes: NDArray[np.int64]
        """Nodes of the skin, by vertex."""
        self.nodes, vertices = np.unique(outer, return_inverse=True)
        self.triangles: NDArray[np.int64] = vertices.reshape(-1, 3)
        """Vertices of each triangle, (m, 3)."""
        self.positions: Reals = (elements.nodes + elements.displacement)[self.nodes]
        """Positions of the vertices now, m, (n, 3)."""

    def wall(self, name: str, material: str) -> dict[str, Any]:
        """The table `[[wall]]` of a scenario for this skin."""
        shape = {"kind": "mesh", "vertices": self.positions.tolist(), "triangles": self.triangles.tolist()}
        return {"name": name, "material": material, "shape": shape}


class SurfaceExchange(NamedTuple):
    """What the last step passed from the particles to the nodes."""

    force: Reals
    """Sum of the forces on the nodes, N, (3,)."""
    moment: Reals
    """Sum of their moments about the origin, N m, (3,)."""
    work: float
    """Work on the nodes during the step, J."""
    nodal: Reals
    """Forces on the nodes of the skin, N, (n, 3)."""


class SurfaceCoupling:
    """Particles that touch the deforming skin of finite elements, under the contact law of the particles.

    Contact forces on a triangle go to its three nodes with the barycentric weights of the contact point, so force, moment, and power are
    those on the particle. The law sees velocity and rotation of the skin. Both sides advance from the same instant: forces of the
    positions at t accelerate particles and nodes alike.

    Args:
        simulation: its scenario has the mesh, such as that of :meth:`Skin.wall`.
        elements: the time step must be that of the particles.
        skin: which node is which vertex.
        mesh: name of the wall; by default the only mesh of the scenario.
        record: whether to record the motion of the skin for :meth:`write_motion`; from step 0 on.
        rescue: folder for the states of both sides if a step fails, and after Ctrl-C; the error then has a note that names the files.
            `restore_elements` reads those of the elements. Default: none.

    Raises CouplingError for pairs that do not fit, and for a mesh that is not where its nodes are.
    """

    def __init__(
        self, simulation: Simulation, elements: FiniteElements, skin: Skin, mesh: str | None = None, record: bool = False,
        rescue: str | PathLike[str] | None = None,
    ) -> None:
        state = simulation.state
        check_scenario(simulation, "surface coupling")
        names = simulation.mesh_names
        if mesh is None and len(names) != 1:
            raise CouplingError(f"the scenario has {len(names)} meshes, {names}; give the name of that of the skin", "Mesh")
        self.simulation, self.elements, self.skin = simulation, elements, skin
        self.mesh: str = names[0] if mesh is None else mesh
        """Name of the wall."""
        present = simulation.mesh(self.mesh)
        if len(present.positions) != len(skin.nodes):
            message = f'the mesh "{self.mesh}" has {len(present.positions)} vertices, the skin {len(skin.nodes)}; give the wall of the skin'
            raise CouplingError(message, "Mesh")
        _check_steps(elements, state)
        if not np.array_equal(present.triangles, skin.triangles):
            raise CouplingError(f'the mesh "{self.mesh}" has other triangles than the skin; give the wall of the skin', "Mesh")
        self._check_places(present.positions)
        if state.step == 0:
            # Elements that move at the start: the first contacts see it.
            simulation.place_mesh(self.mesh, self._places(), elements.velocity[skin.nodes])
        self.work = 0.0
        """Work of the particles on the elements so far, J: that of the elements on the particles, with the opposite sign, is in the
        boundary work of the particles' ledger."""
        self.impulse: Reals = np.zeros(3)
        """Momentum passed to the elements so far, N s, (3,)."""
        self.last: SurfaceExchange | None = None
        """The last exchange."""
        self._rescue = rescue
        self._record = MotionRecord(state.step) if record else None
        if self._record is not None:
            self._record.add("wall", self.mesh, self._places(), elements.velocity[skin.nodes])

    def _places(self) -> Reals:
        places: Reals = (self.elements.nodes + self.elements.displacement)[self.skin.nodes]
        return places

    def _check_places(self, positions: Reals) -> None:
        gap = np.linalg.norm(positions - self._places(), axis=1)
        # Both are the same sums, but for the rounding of the file with the start positions.
        if gap.max() > 1e-9 * float(np.ptp(self.elements.nodes, axis=0).max()):
            worst = int(np.argmax(gap))
            message = (
                f'vertex {worst} of the mesh "{self.mesh}" is {gap[worst]:.3g} m away from node {self.skin.nodes[worst]}; move nodes and '
                "vertices only by steps of this coupling, and restore both sides of a saved run"
            )
            raise CouplingError(message, "Mesh")

    def step(self, count: int = 1, load: ArrayLike | None = None) -> None:
        """Advance both sides by `count` steps, under further forces `load` on the nodes, N, (n, 3)."""
        elements = self.elements
        outer = np.zeros_like(elements.nodes) if load is None else _vectors("load", load, len(elements.nodes))
        with rescued(self._rescue, self.simulation, [self.elements]) as between:
            for _ in range(count):
                self._advance(outer)
                between()

    def _advance(self, outer: Reals) -> None:
        """One step."""
        elements, simulation, nodes = self.elements, self.simulation, self.skin.nodes
        _check_steps(elements, simulation.state)
        present = simulation.mesh(self.mesh).positions
        self._check_places(present)
        number = simulation.state.step
        simulation.step(1)
        if simulation.state.step == number:
            raise CouplingError("the run of the particles has ended; give [stop] more steps", "Stopped")
        # Forces of the positions before the step.
        force = simulation.mesh(self.mesh).forces
        nodal = outer.copy()
        nodal[nodes] += force
        dt, before = elements.time_step, elements.velocity[nodes].copy()
        elements.step(nodal)
        after = elements.velocity[nodes]
        simulation.place_mesh(self.mesh, self._places(), after)
        if self._record is not None:
            self._record.add("wall", self.mesh, self._places(), after)
        # Forces at an instant work over the half steps before and after it.
        work = float(np.vdot(force, 0.5 * dt * (before + after)))
        total: Reals = force.sum(axis=0)
        self.last = SurfaceExchange(total, cross(present, force).sum(axis=0), work, force)
        self.work += work
        self.impulse = self.impulse + dt * total

    def write_motion(self, folder: str | PathLike[str]) -> list[dict[str, Any]]:
        """Write the recorded motion to the folder; returns the tables ``[[slave]]`` with which a scenario in that folder repeats the run
        without finite elements, to the bit."""
        return written(self._record, folder)


def _check_steps(elements: FiniteElements, state: Any) -> None:
    """Whether both sides have one time step."""
    if abs(elements.time_step - state.time_step) > 1e-9 * state.time_step:
        message = (
            f"the time step of the elements is {elements.time_step:.6e} s, that of the particles {state.time_step:.6e} s; they must be "
            f"equal: fix integration.time_step, and give the elements {state.time_step:.17g} s"
        )
        raise CouplingError(message, "TimeStep")
