"""Contact coupling: elements that touch each other, and particles, under the contact laws of the particles."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any, Mapping, NamedTuple, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._errors import CouplingError
from ._embedding import couples_of, spins_of
from ._protocol import FiniteElements, Reals, _vectors, check_scenario, cross
from ._record import MotionRecord, written
from ._rescue import rescued
from ._surface import Skin, _check_steps

if TYPE_CHECKING:
    from .._core import Simulation

# Distance of a point of the skin from the nearest center, over the radius, at the start. The rest is left for stretching.
_COVER = 0.5
# A sphere whose center comes nearer to a mesh than this fraction of its radius is about to pass through it.
_DEEPEST = 0.1
# Overlaps below this fraction of the radius are rounding.
_SHALLOW = 1e-9


class SkinSpheres:
    """Spheres whose centers are fixed in the triangles of a skin, so dense that no other surface passes between them.

    In a triangle with the vertices x_i, the sphere at the barycentric weights w_i has position, velocity, and spin

    ``x = sum of w_i x_i``, ``v = sum of w_i v_i``, ``w = T^-1 sum of r_i x v_i``

    with ``r_i = x_i - (x_1 + x_2 + x_3)/3`` and ``T = sum of (r_i . r_i 1 - r_i r_i)``: the spin of the rigid body nearest to the
    triangle. Force F and moment M on the sphere become the forces

    ``f_i = w_i F + (T^-1 M) x r_i``

    on the vertices, which have the same sum, the same moment about every point, and the same power.

    Args:
        skin: its triangles carry the spheres.
        radius: m.
        cover: largest distance of a point of the skin from the nearest center at the start, in radii; below 1.
    """

    def __init__(self, skin: Skin, radius: float, cover: float = _COVER) -> None:
        if not (radius > 0 and np.isfinite(radius)):
            raise ValueError(f"radius is {radius}; it must be positive and finite")
        if not 0 < cover < 1:
            raise ValueError(f"cover is {cover}; it must be greater than 0 and less than 1")
        self.radius = float(radius)
        corners = skin.positions[skin.triangles]
        self._parts = _parts(corners, cover * radius)
        triangle, weights = [], []
        for k, parts in enumerate(self._parts):
            steps = [(i, j) for i in range(parts + 1) for j in range(parts + 1 - i)]
            triangle += [k] * len(steps)
            weights += [(i / parts, j / parts, 1 - i / parts - j / parts) for i, j in steps]
        chosen, shares = np.array(triangle), np.array(weights)
        centers = np.einsum("kc,kci->ki", shares, corners[chosen])
        # One sphere where triangles meet. Places that are equal differ by rounding.
        size = float(np.ptp(skin.positions, axis=0).max())
        _, first = np.unique(np.round(centers / (1e-9 * size)).astype(np.int64), axis=0, return_index=True)
        first.sort()
        self.triangle: NDArray[np.int64] = chosen[first]
        """Triangle of each sphere, (k,)."""
        self.weights: Reals = shares[first]
        """Barycentric weights of the centers, (k, 3)."""
        self._vertices: NDArray[np.int64] = skin.triangles[self.triangle]
        self._triangles = skin.triangles

    def __len__(self) -> int:
        return len(self.triangle)

    def positions(self, vertices: ArrayLike) -> Reals:
        """Centers for these positions of the vertices of the skin, m, (k, 3)."""
        result: Reals = np.einsum("kc,kci->ki", self.weights, np.asarray(vertices)[self._vertices])
        return result

    def motion(self, vertices: Reals, velocity: Reals) -> tuple[Reals, Reals]:
        """Velocities (m/s) and angular velocities (rad/s) of the spheres for positions and velocities of the vertices, (k, 3) each."""
        corners = velocity[self._vertices]
        return np.einsum("kc,kci->ki", self.weights, corners), spins_of(vertices[self._vertices], corners)

    def distribute(self, vertices: Reals, force: Reals, moment: Reals) -> Reals:
        """Forces on the vertices (N) of forces (N) and moments (N m) on the spheres, (n, 3)."""
        local = self.weights[..., None] * force[:, None, :] + couples_of(vertices[self._vertices], moment)
        result = np.empty_like(vertices)
        for i in range(3):
            result[:, i] = np.bincount(self._vertices.ravel(), weights=local[..., i].ravel(), minlength=len(vertices))
        return result

    def widest(self, vertices: Reals) -> float:
        """Largest distance of a point of the skin from the nearest center for these positions of the vertices, m: an upper bound."""
        return float((_longest(vertices[self._triangles]) / self._parts).max() / np.sqrt(3.0))


def _longest(corners: Reals) -> Reals:
    """Longest side of each triangle, m."""
    longest: Reals = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return longest


def _parts(corners: Reals, reach: float) -> NDArray[np.int64]:
    """Parts of each side such that no point of the triangle is farther than `reach` (m) from a corner of a part.

    A point of a triangle with the longest side a is nowhere farther than a/sqrt(3) from the nearest corner (the circumcenter of an
    equilateral one).
    """
    parts: NDArray[np.int64] = np.maximum(1, np.ceil(_longest(corners) / (np.sqrt(3.0) * reach) * (1 - 1e-12))).astype(np.int64)
    return parts


class ContactBody:
    """A body of elements that touches others.

    Args:
        name: of its mesh and its material in the scenario.
        elements: finite elements in space.
        law: tables of the contact laws, as in ``[[material]]``: ``{"frictional": {...}}``.
        radius: of the spheres on its skin, m. None: no spheres; the spheres of the other body touch its mesh. Of two bodies that may
            touch, one at least needs spheres. With spheres on both, contacts act from both sides: with twice the stiffness.
        cover: see :class:`SkinSpheres`.
        skin: by default all outer faces of `elements.mesh`.

    The spheres stand out from the skin by their radius: bodies touch at that distance.
    """

    def __init__(
        self,
        name: str,
        elements: FiniteElements,
        law: Mapping[str, Any],
        radius: float | None = None,
        cover: float = _COVER,
        skin: Skin | None = None,
    ) -> None:
        if not name or name == "particles":
            raise ValueError(f'name is "{name}"; give a name other than "particles"')
        self.name, self.elements, self.law = name, elements, dict(law)
        self.skin = Skin(elements) if skin is None else skin
        self.spheres = None if radius is None else SkinSpheres(self.skin, radius, cover)

    @property
    def vertices(self) -> Reals:
        """Positions of the vertices of the skin now, m, (n, 3)."""
        places: Reals = (self.elements.nodes + self.elements.displacement)[self.skin.nodes]
        return places

    @property
    def of_spheres(self) -> str:
        """Material and set of the spheres."""
        return f"{self.name} spheres"


def contact_tables(
    bodies: Sequence[ContactBody],
    contact_law: str = "frictional",
    particles: ArrayLike | None = None,
    material: Mapping[str, Any] | None = None,
    density: float = 1000.0,
) -> dict[str, Any]:
    """Tables of a scenario for bodies that touch: packing, material, contacts, wall, set, and prescribe.

    Args:
        bodies: in the order of :class:`ContactCoupling`.
        contact_law: name of the law of the contacts.
        particles: free spheres, m, (n, 4): position and radius; their ids are 0 to n - 1. None: no particles.
        material: table ``[[material]]`` of the particles, without a name: density and laws.
        density: of the spheres on the skins, kg/m^3. It sets the mass of which laws take their damping ratio; nothing else.

    Give the other tables besides: ``Scenario(**contact_tables(bodies), integration={"time_step": 1e-5}, stop={"steps": 1000})``.
    """
    names = [body.name for body in bodies]
    if len(set(names)) < len(names) or not names:
        raise ValueError(f"the bodies are named {names}; give one body or more, each with a name of its own")
    free = np.zeros((0, 4)) if particles is None else np.array(particles, dtype=float)
    if free.ndim != 2 or free.shape[1] != 4:
        raise ValueError(f"particles has shape {free.shape}; give x, y, z, radius: (n, 4)")
    if (material is None) == (len(free) > 0):
        raise ValueError("give both particles and their material, or none of them")
    spheres = free.tolist()
    materials: list[dict[str, Any]] = [] if material is None else [{"name": "particles"} | dict(material)]
    walls, sets, prescribed, exclude = [], [], [], []
    for body in bodies:
        if body.spheres is None:
            materials.append({"name": body.name, "density": density} | body.law)
        else:
            centers = body.spheres.positions(body.vertices)
            ids = list(range(len(spheres), len(spheres) + len(centers)))
            spheres += [[*center, body.spheres.radius] for center in centers.tolist()]
            materials += [{"name": name, "density": density} | body.law for name in (body.of_spheres, body.name)]
            sets.append({"name": body.of_spheres, "selection": {"kind": "ids", "ids": ids}, "material": body.of_spheres})
            prescribed.append({"set": body.of_spheres, "velocity": [0.0] * 3, "angular_velocity": [0.0] * 3})
            # Spheres touch neither their own mesh nor other spheres: those of the other body would count the contact again.
            exclude.append([body.of_spheres, body.name])
            if material is not None:
                exclude.append([body.of_spheres, "particles"])
        walls.append(body.skin.wall(body.name, body.name))
    covered = [body.of_spheres for body in bodies if body.spheres is not None]
    exclude += [[a, b] for k, a in enumerate(covered) for b in covered[: k + 1]]
    if not spheres:
        raise ValueError("no body has spheres, and there are no particles: nothing would touch; give a body a radius")
    return {
        "packing": {"kind": "spheres", "spheres": spheres}, "material": materials, "wall": walls, "set": sets, "prescribe": prescribed,
        "contacts": {"law": contact_law, "exclude": exclude},
    }


class ContactExchange(NamedTuple):
    """What the last step passed to one body."""

    force: Reals
    """Sum of the contact forces on its nodes, N, (3,)."""
    moment: Reals
    """Sum of their moments about the origin, N m, (3,)."""
    work: float
    """Work on its nodes during the step, J."""
    nodal: Reals
    """Forces on the nodes of the skin, N, (n, 3)."""


class ContactCoupling:
    """Bodies of elements that touch each other, and free particles, under the contact law of the scenario.

    Each body is a mesh of the scenario; the skin of a body may carry spheres (:class:`SkinSpheres`) that move with it and touch the
    meshes of the other bodies. A contact is one of the core, with its law, friction, and history. Its two forces act at one point; that
    on the sphere and that on the mesh both go to the nodes of their triangles, so momentum, angular momentum, and power pass without
    loss. All bodies advance from the same instant, with one time step.

    No point of a skin with spheres is farther than `cover` radii from a center. So another skin cannot come nearer than ``1 - cover``
    radii without a force, edges against edges included; a flat one not nearer than ``sqrt(1 - cover^2)`` radii.

    Args:
        simulation: of a scenario with the tables of :func:`contact_tables`.
        bodies: in the same order.
        record: whether to record the motion of meshes and spheres for :meth:`write_motion`; from step 0 on.
        rescue: folder for the states of both sides if a step fails, and after Ctrl-C; the error then has a note that names the files.
            `restore_elements` reads those of the elements. Default: none.

    Raises CouplingError for pairs that do not fit, time steps above the stable one with the contacts, spheres that a body has pressed
    through, and skins so stretched that the spheres do not cover them.
    """

    def __init__(
        self, simulation: Simulation, bodies: Sequence[ContactBody], record: bool = False, rescue: str | PathLike[str] | None = None,
    ) -> None:
        state = simulation.state
        check_scenario(simulation, "contact coupling")
        tables = simulation.scenario.to_dict()
        if tables.get("clump"):
            raise CouplingError("the contact coupling takes single spheres; remove [[clump]]", "Clumps")
        if any("deformable" in material for material in tables["material"]):
            raise CouplingError("the contact coupling takes rigid spheres; remove material.deformable", "Deformable")
        self.simulation, self.bodies = simulation, list(bodies)
        last = len(state)
        self._ids: list[NDArray[np.int64]] = []
        for body in reversed(self.bodies):
            count = 0 if body.spheres is None else len(body.spheres)
            self._ids.insert(0, np.arange(last - count, last))
            last -= count
        if last < 0:
            raise CouplingError(f"the scenario has {len(state)} particles, the bodies more spheres; give those of the scenario", "Bodies")
        self._free = last
        for body in self.bodies:
            if body.name not in simulation.mesh_names:
                message = f'no mesh of the scenario is named "{body.name}", but {simulation.mesh_names}; use contact_tables'
                raise CouplingError(message, "Mesh")
            _check_steps(body.elements, state)
            mesh = simulation.mesh(body.name)
            if len(mesh.positions) != len(body.skin.nodes) or not np.array_equal(mesh.triangles, body.skin.triangles):
                raise CouplingError(f'the mesh "{body.name}" has other triangles than the skin; give the body of the scenario', "Mesh")
        self._check_places()
        rows = self._rows()
        self._rescue = rescue
        self._record = MotionRecord(state.step) if record else None
        if state.step == 0:
            # Elements that move at the start: the first contacts see it.
            velocities, spins = state.writable("velocities"), state.writable("angular_velocities")
            for body, own in zip(self.bodies, rows, strict=True):
                velocity = body.elements.velocity[body.skin.nodes]
                simulation.place_mesh(body.name, body.vertices, velocity)
                if body.spheres is not None:
                    velocities[own], spins[own] = body.spheres.motion(body.vertices, velocity)
                self._note(body, velocity, velocities[own], spins[own])
        self.work: Reals = np.zeros(len(self.bodies))
        """Work of the contacts on each body so far, J."""
        self.impulse: Reals = np.zeros((len(self.bodies), 3))
        """Momentum passed to each body so far, N s."""
        self.last: list[ContactExchange] = []
        """The last exchange, by body."""
        # At the first touch, dashpots make a contact look stiff: then the time step must be too long in two steps in succession.
        self._damped = any(table.get("damping_ratio", 0.0) for body in self.bodies for table in body.law.values())
        self._suspects: dict[str, float] = {}

    def _note(self, body: ContactBody, velocity: Reals, of_spheres: Reals, spins: Reals) -> None:
        """Record a motion."""
        if self._record is not None:
            self._record.add("wall", body.name, velocity)
            if body.spheres is not None:
                self._record.add("set", body.of_spheres, of_spheres, spins)

    def _rows(self) -> list[NDArray[np.int64]]:
        """Rows of the spheres of each body in the state, which may sort its particles anew."""
        order = np.argsort(self.simulation.state.ids)
        return [order[ids] for ids in self._ids]

    def _check_places(self) -> None:
        """Whether meshes and spheres are where their bodies are."""
        positions = self.simulation.state.positions
        for body, rows in zip(self.bodies, self._rows(), strict=True):
            vertices = body.vertices
            pairs = [("vertex", self.simulation.mesh(body.name).positions, vertices)]
            if body.spheres is not None:
                pairs.append(("sphere", positions[rows], body.spheres.positions(vertices)))
            size = float(np.ptp(body.elements.nodes, axis=0).max())
            for what, there, here in pairs:
                gap = np.linalg.norm(there - here, axis=1)
                # Positions are sums of up to 1e7 steps, each rounded by 1e-16 of the size.
                if gap.max() > 1e-9 * (size + float(np.abs(here).max())):
                    message = (
                        f'{what} {int(np.argmax(gap))} of "{body.name}" is {gap.max():.3g} m away from its place; move the nodes only by '
                        "steps of this coupling, prescribe the spheres as contact_tables does, and restore both sides of a saved run"
                    )
                    raise CouplingError(message, "Mesh")

    def forces(self) -> list[Reals]:
        """Contact forces on the nodes of each skin at the present instant, N, (n, 3) each."""
        # Contacts between particles do not reach the bodies.
        forces = self.simulation.forces(border=[])
        state = self.simulation.state
        walls, positions = forces.walls, state.positions
        force, moment = np.zeros((len(state), 3)), np.zeros((len(state), 3))
        arm = walls.point - positions[walls.particle]
        np.add.at(force, walls.particle, walls.force)
        couple = cross(arm, walls.force)
        if walls.moment is not None:
            couple = couple + walls.moment
        np.add.at(moment, walls.particle, couple)
        depth = state.radii[walls.particle] - np.linalg.norm(arm, axis=1)
        self._check_depth(walls.particle, depth)
        self._check_stable(walls, depth)
        result = []
        for body, rows in zip(self.bodies, self._rows(), strict=True):
            nodal = np.array(forces.meshes[body.name])
            if body.spheres is not None:
                nodal += body.spheres.distribute(body.vertices, force[rows], moment[rows])
            result.append(nodal)
        return result

    def _check_depth(self, particle: NDArray[Any], depth: Reals) -> None:
        """Whether a sphere is about to pass through a mesh, and whether the spheres still cover their skins."""
        state = self.simulation.state
        deep = depth > (1 - _DEEPEST) * state.radii[particle]
        if deep.any():
            worst = int(np.argmax(depth / state.radii[particle]))
            message = (
                f"particle {state.ids[particle[worst]]} is pressed {depth[worst]:.3g} m into a mesh, nearly its radius; use stiffer "
                "contacts, larger spheres on the skin, or lower speeds"
            )
            raise CouplingError(message, "Deep")
        for body in self.bodies:
            if body.spheres is not None and body.spheres.widest(body.vertices) >= body.spheres.radius:
                message = f'the skin of "{body.name}" has stretched so far that its spheres leave gaps; give a smaller cover'
                raise CouplingError(message, "Cover")

    def _check_stable(self, walls: Any, depth: Reals) -> None:
        """Whether the time step is stable with the contacts.

        The stiffness of the contacts adds to that of the elements. The largest eigenvalue of ``m^-1 sum of k w w^T`` is at most its
        largest row sum ``sum of k w_i / m_i`` (Gershgorin; the weights of a contact add up to 1). k: 3/2 of force over overlap, that of
        Hertz.
        """
        radii = self.simulation.state.radii[walls.particle]
        used = depth > _SHALLOW * self.simulation.state.radii[walls.particle]
        suspects: dict[str, float] = {}
        stiffness = 1.5 * np.linalg.norm(walls.force[used], axis=1) / depth[used]
        particle, point = walls.particle[used], walls.point[used]
        for body, rows in zip(self.bodies, self._rows(), strict=True):
            elements = body.elements
            stable, mass = getattr(elements, "stable_time_step", None), getattr(elements, "mass", None)
            if stable is None or mass is None or not used.any():
                continue
            total = np.zeros(len(body.skin.nodes))
            mine = np.zeros(len(particle), dtype=bool)
            if body.spheres is not None:
                number = np.full(len(self.simulation.state), -1)
                number[rows] = np.arange(len(rows))
                own = number[particle]
                mine = own >= 0
                vertices = body.skin.triangles[body.spheres.triangle[own[mine]]]
                np.add.at(total, vertices, stiffness[mine, None] * body.spheres.weights[own[mine]])
            triangle, weights = _on_surface(body.vertices[body.skin.triangles], point[~mine])
            found = triangle >= 0
            np.add.at(total, body.skin.triangles[triangle[found]], stiffness[~mine][found, None] * weights[found])
            held = getattr(elements, "fixed", None)
            if held is not None:
                total[np.asarray(held)[body.skin.nodes].all(axis=1)] = 0.0
            square = float((total / mass[body.skin.nodes]).max())
            bound = 2.0 / np.sqrt((2.0 / stable) ** 2 + square)
            if elements.time_step > bound:
                suspects[body.name] = bound
                if not self._damped or body.name in self._suspects:
                    message = (
                        f'with the contacts of "{body.name}" the time step is stable up to {bound:.3e} s, less than '
                        f"{elements.time_step:.3e} s; use a smaller time step, softer contacts, or fewer spheres"
                    )
                    raise CouplingError(message, "TimeStep")
        self._suspects = suspects

    def step(self, count: int = 1, loads: Sequence[ArrayLike | None] | None = None) -> None:
        """Advance all sides by `count` steps, under further forces on the nodes of each body, N, (n, 3) each."""
        given = [None] * len(self.bodies) if loads is None else list(loads)
        if len(given) != len(self.bodies):
            raise ValueError(f"{len(given)} loads for {len(self.bodies)} bodies; give one per body, or None")
        outer = [
            np.zeros_like(body.elements.nodes) if load is None else _vectors("load", load, len(body.elements.nodes))
            for body, load in zip(self.bodies, given, strict=True)
        ]
        with rescued(self._rescue, self.simulation, [body.elements for body in self.bodies]) as between:
            for _ in range(count):
                self._advance(outer)
                between()

    def _advance(self, outer: list[Reals]) -> None:
        """One step."""
        simulation = self.simulation
        number = simulation.state.step
        for body in self.bodies:
            _check_steps(body.elements, simulation.state)
        if simulation.stopped is not None:
            raise CouplingError("the run of the particles has ended; give [stop] more steps", "Stopped")
        contact = self.forces()
        rows = self._rows()
        state = simulation.state
        # Free particles have no targets; what stands in their rows has no effect.
        targets, spins = np.array(state.velocities), np.array(state.angular_velocities)
        self.last = []
        for k, (body, nodal) in enumerate(zip(self.bodies, contact, strict=True)):
            elements, nodes = body.elements, body.skin.nodes
            vertices, before = body.vertices, elements.velocity[nodes].copy()
            load = outer[k].copy()
            load[nodes] += nodal
            elements.step(load)
            after = elements.velocity[nodes]
            simulation.drive_mesh(body.name, after)
            if body.spheres is not None:
                targets[rows[k]], spins[rows[k]] = body.spheres.motion(vertices, after)
            self._note(body, after, targets[rows[k]], spins[rows[k]])
            # Forces at an instant work over the half steps before and after it.
            work = float(np.vdot(nodal, 0.5 * elements.time_step * (before + after)))
            total: Reals = nodal.sum(axis=0)
            self.last.append(ContactExchange(total, cross(vertices, nodal).sum(axis=0), work, nodal))
            self.work[k] += work
            self.impulse[k] += elements.time_step * total
        simulation.set_motion(targets, spins)
        simulation.step(1)
        if simulation.state.step == number:
            raise CouplingError("the run of the particles has ended; give [stop] more steps", "Stopped")
        self._check_places()

    def write_motion(self, folder: str | PathLike[str]) -> list[dict[str, Any]]:
        """Write the recorded motion to the folder; returns the tables ``[[slave]]`` with which a scenario in that folder repeats the run
        without finite elements, to the bit."""
        return written(self._record, folder)


def _on_surface(corners: Reals, points: Reals) -> tuple[NDArray[np.int64], Reals]:
    """Triangle (m, 3, 3) on which each point lies, -1 for none, and its barycentric weights, (k,) and (k, 3)."""
    # Around the origin, against rounding.
    middle = corners.mean(axis=(0, 1))
    a, edge, other = corners[:, 0] - middle, corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = cross(edge, other)
    square = np.einsum("ti,ti->t", normal, normal)

    def along(directions: Reals) -> Reals:
        """Components of the vectors from the first corners to the points, (k, t): products of matrices, three times as fast as with vectors."""
        components: Reals = (points - middle) @ directions.T - np.einsum("ti,ti->t", a, directions)
        return components

    v = along(cross(other, normal) / square[:, None])
    w = along(cross(normal, edge) / square[:, None])
    height = np.abs(along(normal / square[:, None] ** 0.75))
    # Contact points are closest points of a triangle, up to rounding.
    outside = np.maximum(-np.minimum(np.minimum(v, w), 1 - v - w), height)
    best = np.argmin(outside, axis=1)
    row = np.arange(len(points))
    v, w = v[row, best], w[row, best]
    weights = np.stack([1 - v - w, v, w], axis=1)
    return np.where(outside[row, best] < 1e-6, best, -1), np.clip(weights, 0.0, 1.0)
