"""Explicit dynamics of large displacements with scikit-fem."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._errors import CouplingError
from ._materials import Material
from ._protocol import Reals, _vectors, cross

_ORDERS = {"MeshHex1": 2, "MeshTet1": 1, "MeshQuad1": 2, "MeshTri1": 1}


def _library() -> Any:
    try:
        import skfem
    except ImportError as error:
        raise ImportError("scikit-fem is missing; install it with: pip install 'concordem[coupling]'") from error
    return skfem


class ScikitDynamics:
    """Finite elements of first order with lumped masses, advanced by central differences (leapfrog).

    ``v(t + dt/2) = ((1 - a dt/2) v(t - dt/2) + dt f(t)/m)/(1 + a dt/2)``, ``x(t + dt) = x(t) + dt v(t + dt/2)``.

    The formulation is total Lagrangian: internal forces are ``sum of P grad N dV`` over the reference volume, with the first
    Piola-Kirchhoff stress P of the material.

    Args:
        mesh: a `MeshHex`, `MeshTet`, `MeshQuad`, or `MeshTri` of scikit-fem, in meters.
        material: see :class:`Material`.
        time_step: s; by default `safety` times the stable one.
        safety: fraction of the stable time step, at most 1. The bound holds in the reference configuration; compressed elements need less.
        damping: mass-proportional damping a, 1/s.
        plane: for meshes in the plane, "strain" or "stress" (needs an :class:`Elastic` material).
        thickness: of a plane mesh, m.
        fixed: nodes whose motion is prescribed, as booleans (n, 3) or (n,); they move with `prescribed` velocities, zero at the start.

    Energies of the steps done: `internal_work`, `external_work`, `damping_loss`, `prescribed_work` (of fixed nodes), J. The balance
    ``kinetic + internal + damping = external + prescribed`` closes to rounding; that `internal_work` is what the material stores is a
    matter of the time step.
    """

    def __init__(
        self,
        mesh: Any,
        material: Material,
        time_step: float | None = None,
        *,
        safety: float = 0.9,
        damping: float = 0.0,
        plane: Literal["strain", "stress"] | None = None,
        thickness: float = 1.0,
        fixed: ArrayLike | None = None,
    ) -> None:
        skfem = _library()
        kind = type(mesh).__name__
        if kind not in _ORDERS:
            raise ValueError(f"the mesh is a {kind}; give MeshHex, MeshTet, MeshQuad, or MeshTri (of first order)")
        element = {
            "MeshHex1": skfem.ElementHex1, "MeshTet1": skfem.ElementTetP1, "MeshQuad1": skfem.ElementQuad1, "MeshTri1": skfem.ElementTriP1,
        }[kind]()
        self.mesh = mesh
        self.dimension = int(mesh.p.shape[0])
        if (plane is None) == (self.dimension == 2):
            raise ValueError('a plane mesh needs plane = "strain" or "stress"; a mesh in space must not have it')
        if plane not in (None, "strain", "stress"):
            raise ValueError(f'plane is "{plane}"; give "strain" or "stress"')
        if not (damping >= 0 and np.isfinite(damping)):
            raise ValueError(f"damping is {damping}; it must not be negative")
        if not 0 < safety <= 1:
            raise ValueError(f"safety is {safety}; it must be greater than 0 and at most 1")
        if not (thickness > 0 and np.isfinite(thickness)) or (thickness != 1.0 and self.dimension == 3):
            raise ValueError(f"thickness is {thickness}; it must be positive, and is for plane meshes only")
        _check_mesh(mesh, element.doflocs)
        basis = skfem.Basis(mesh, element, intorder=_ORDERS[kind])
        volumes = np.asarray(basis.dx) * thickness
        # (elements, points, local nodes, dimension)
        gradients = np.stack([np.asarray(function[0].grad) for function in basis.basis], axis=-1)
        self._gradients: Reals = np.ascontiguousarray(np.moveaxis(gradients, [0, 1, 2], [-1, 0, 1]))
        elements, _, nodes, d = self._gradients.shape
        # (elements, local nodes, points times dimension), and its transpose
        self._by_node: Reals = np.ascontiguousarray(self._gradients.transpose(0, 2, 1, 3)).reshape(elements, nodes, -1)
        self._by_element: Reals = np.ascontiguousarray(self._by_node.transpose(0, 2, 1))
        values = np.stack([np.broadcast_to(np.asarray(function[0]), volumes.shape) for function in basis.basis], axis=-1)
        # For elements of first order the degrees of freedom of the basis are the nodes of the mesh.
        self._local: NDArray[np.int64] = np.ascontiguousarray(basis.dofs.element_dofs.T).astype(np.int64)
        self._volumes: Reals = volumes
        self._values: Reals = values
        self._plane, self._damping = plane, float(damping)
        count = int(mesh.p.shape[1])
        self._nodes = np.zeros((count, 3))
        self._nodes[:, : self.dimension] = mesh.p.T
        self.material = material
        # Size of an element: the edge of a cube, or of a square, of its volume.
        per_element = volumes.sum(axis=1) / thickness
        sizes = per_element ** (1.0 / self.dimension)
        material.start(np.repeat(sizes, volumes.shape[1]))
        density = np.asarray(material.density, dtype=float)
        if density.shape not in ((), (len(volumes),)):
            raise CouplingError(f"{len(density)} densities for {len(volumes)} elements; give one per element", "Count")
        mass = np.einsum("eqa,eq->ea", values, volumes) * np.broadcast_to(density, len(volumes))[:, None]
        self.mass: Reals = np.asarray(np.bincount(self._local.ravel(), weights=mass.ravel(), minlength=count), dtype=float)
        if (self.mass <= 0).any():
            raise CouplingError(f"node {int(np.argmin(self.mass))} belongs to no element; remove it from the mesh", "Mesh")
        self.fixed: NDArray[np.bool_] = np.zeros((count, 3), dtype=bool)
        if fixed is not None:
            mask = np.asarray(fixed, dtype=bool)
            if mask.shape not in ((count,), (count, 3)):
                raise ValueError(f"fixed has shape {mask.shape}; give ({count},) or ({count}, 3)")
            self.fixed |= mask[:, None] if mask.ndim == 1 else mask
        self._condensed = self._plane_matrix()
        self.stable_time_step = self._stable(mass)
        self._time_step = safety * self.stable_time_step if time_step is None else float(time_step)
        if not 0 < self._time_step <= self.stable_time_step:
            message = f"time_step is {self._time_step:.6e} s; it must be positive and at most the stable one, {self.stable_time_step:.6e} s"
            raise CouplingError(message, "TimeStep")
        self._displacement = np.zeros((count, 3))
        self._velocity = np.zeros((count, 3))
        self.prescribed: Reals = np.zeros((count, 3))
        self._last = np.zeros((count, 3))
        self.steps = 0
        self.internal_work = self.external_work = self.damping_loss = self.prescribed_work = 0.0
        # Initial velocities need no work.
        self._initial: float | None = None

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
        """Velocities at the half step before, m/s, (n, 3). Write initial velocities into it before the first step."""
        return self._velocity

    @property
    def time_step(self) -> float:
        """Time step, s."""
        return self._time_step

    @property
    def time(self) -> float:
        """Time, s."""
        return self.steps * self._time_step

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy of the velocities at the half step, J."""
        return 0.5 * float(np.einsum("n,ni,ni->", self.mass, self._velocity, self._velocity))

    @property
    def balance(self) -> float:
        """Residual of the energy balance, J: rounding."""
        given = self.external_work + self.prescribed_work + (self._initial or 0.0)
        return self.kinetic_energy + self.internal_work + self.damping_loss - given

    def momentum(self) -> Reals:
        """Linear momentum, N s, (3,)."""
        total: Reals = self.mass @ self._velocity
        return total

    def angular_momentum(self) -> Reals:
        """Angular momentum about the origin, N m s, (3,), at the half step."""
        middle = self._nodes + self._displacement - 0.5 * self._time_step * self._velocity
        total: Reals = self.mass @ cross(middle, self._velocity)
        return total

    def points(self) -> Reals:
        """Positions of the integration points, element by element, m, (n, 3): ``sum of N_a x_a``."""
        places: Reals = np.einsum("eqa,eai->eqi", self._values, (self._nodes + self._displacement)[self._local]).reshape(-1, 3)
        return places

    def deformation_gradient(self) -> Reals:
        """Deformation gradients at the integration points, (n, 3, 3). Raises CouplingError if an element is inverted."""
        gradient = np.zeros((*self._volumes.shape, 3, 3))
        local = self._displacement[self._local][..., : self.dimension]
        d = self.dimension
        elements, points, nodes, _ = self._gradients.shape
        product = local.transpose(0, 2, 1) @ self._by_node
        gradient[..., :d, :d] = product.reshape(elements, d, points, d).transpose(0, 2, 1, 3)
        gradient += np.eye(3)
        gradient = gradient.reshape(-1, 3, 3)
        a, b, c = gradient[:, 0], gradient[:, 1], gradient[:, 2]
        # The determinant. numpy.linalg.det takes ten times as long.
        volume = (
            a[:, 0] * (b[:, 1] * c[:, 2] - b[:, 2] * c[:, 1])
            - a[:, 1] * (b[:, 0] * c[:, 2] - b[:, 2] * c[:, 0])
            + a[:, 2] * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
        )
        if not np.isfinite(volume).all():
            raise CouplingError(f"at step {self.steps} a displacement is not finite; use a smaller time step", "NotFinite")
        if (volume <= 0).any():
            worst = int(np.argmin(volume)) // self._volumes.shape[1]
            message = f"at step {self.steps} element {worst} is inverted; use a finer mesh, smaller loads, or a smaller time step"
            raise CouplingError(message, "Inverted")
        return gradient

    def _points(self, gradient: Reals) -> Reals:
        """Stress at the points, with the conditions of a plane."""
        if self._condensed is None:
            return self.material.stress(gradient)
        strain = 0.5 * (np.einsum("pki,pkj->pij", gradient, gradient) - np.eye(3))
        reduced = np.stack([strain[:, 0, 0], strain[:, 1, 1], 2 * strain[:, 0, 1]], axis=1) @ self._condensed.T
        second = np.zeros_like(gradient)
        second[:, 0, 0], second[:, 1, 1] = reduced[:, 0], reduced[:, 1]
        second[:, 0, 1] = second[:, 1, 0] = reduced[:, 2]
        return gradient @ second

    def _plane_matrix(self) -> Reals | None:
        """Stiffness in a plane without stress across it."""
        if self._plane != "stress":
            return None
        if type(self.material).__name__ != "Elastic":
            raise ValueError("plane stress needs an Elastic material; use plane strain, or a mesh in space")
        inside, across = [0, 1, 5], [2, 3, 4]
        full = self.material.stiffness()
        matrix: Reals = full[np.ix_(inside, inside)] - full[np.ix_(inside, across)] @ np.linalg.solve(
            full[np.ix_(across, across)], full[np.ix_(across, inside)]
        )
        return matrix

    def internal_forces(self) -> Reals:
        """Internal forces ``sum of P grad N dV`` on the nodes, N, (n, 3). Materials with a memory advance to the present strain."""
        stress = self._points(self.deformation_gradient()).reshape(*self._volumes.shape, 3, 3)[..., : self.dimension]
        # One product per element: numpy.einsum takes three times as long.
        elements, points, nodes, d = self._gradients.shape
        weighted = (stress[..., :d, :] * self._volumes[..., None, None]).transpose(0, 2, 1, 3).reshape(elements, d, points * d)
        local = np.zeros((elements, nodes, 3))
        local[..., :d] = (weighted @ self._by_element).transpose(0, 2, 1)
        forces = np.empty_like(self._nodes)
        for i in range(3):
            forces[:, i] = np.bincount(self._local.ravel(), weights=local[..., i].ravel(), minlength=len(forces))
        return forces

    def stored_energy(self) -> float | None:
        """Energy that the material stores, J; None if it does not know."""
        gradient = self.deformation_gradient()
        if self._condensed is None:
            density = self.material.energy(gradient)
        else:
            strain = 0.5 * (np.einsum("pki,pkj->pij", gradient, gradient) - np.eye(3))
            reduced = np.stack([strain[:, 0, 0], strain[:, 1, 1], 2 * strain[:, 0, 1]], axis=1)
            density = 0.5 * np.einsum("pi,ij,pj->p", reduced, self._condensed, reduced)
        return None if density is None else float(density @ self._volumes.ravel())

    def step(self, force: ArrayLike | None = None) -> None:
        """Advance one time step under these external nodal forces, N, (n, 3)."""
        dt, mass = self._time_step, self.mass[:, None]
        if self._initial is None:
            self._initial = self.kinetic_energy
        external = np.zeros_like(self._nodes) if force is None else _vectors("force", force, len(self._nodes))
        internal = self.internal_forces()
        before = self._velocity
        half = 0.5 * self._damping * dt
        after = ((1 - half) * before + dt * (external - internal) / mass) / (1 + half)
        after[self.fixed] = self.prescribed[self.fixed]
        if self.dimension == 2:
            after[:, 2] = 0.0
        # Forces work over the half steps before and after the present instant: the sum of all works is the change of the kinetic energy.
        path = 0.5 * dt * (before + after)
        inertia = mass * (after - before) / dt
        drag = self._damping * mass * 0.5 * (before + after)
        reaction = inertia + internal + drag - external
        reaction[~self.fixed] = 0.0
        self.internal_work += float(np.vdot(internal, path))
        self.external_work += float(np.vdot(external, path))
        self.damping_loss += float(np.vdot(drag, path))
        self.prescribed_work += float(np.vdot(reaction, path))
        self._velocity = after
        self._displacement = self._displacement + dt * after
        self.steps += 1

    def save(self) -> Any:
        """The complete state."""
        numbers = (self.steps, self.internal_work, self.external_work, self.damping_loss, self.prescribed_work, self._initial)
        return self._displacement.copy(), self._velocity.copy(), self.prescribed.copy(), numbers, self.material.save()

    def restore(self, state: Any) -> None:
        """Go back to a state of `save`; the elements then continue bit by bit."""
        displacement, velocity, prescribed, numbers, material = state
        self._displacement, self._velocity, self.prescribed = displacement.copy(), velocity.copy(), prescribed.copy()
        self.steps, self.internal_work, self.external_work, self.damping_loss, self.prescribed_work, self._initial = numbers
        self.material.restore(material)

    def _stable(self, mass: Reals) -> float:
        """``2/omega`` of the stiffest element alone, a lower bound of that of the mesh (Irons and Treharne)."""
        d = self.dimension
        pairs = [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)] if d == 3 else [(0, 0), (1, 1), (0, 1)]
        if d == 3:
            matrix = self.material.stiffness()
        elif self._condensed is None:
            matrix = self.material.stiffness()[..., [0, 1, 5], :][..., [0, 1, 5]]
        else:
            matrix = self._condensed
        elements, _, nodes, _ = self._gradients.shape
        matrix = np.broadcast_to(matrix, (elements, *matrix.shape[-2:]))
        largest = 0.0
        # In blocks, so that the matrices of large meshes fit into memory.
        for begin in range(0, elements, 2048):
            g = self._gradients[begin : begin + 2048]
            b = np.zeros((*g.shape[:2], len(pairs), nodes, d))
            for row, (i, j) in enumerate(pairs):
                b[:, :, row, :, i] += g[..., j]
                if i != j:
                    b[:, :, row, :, j] += g[..., i]
            b = b.reshape(*b.shape[:3], nodes * d)
            k = np.einsum(
                "eqri,ers,eqsj,eq->eij", b, matrix[begin : begin + 2048], b, self._volumes[begin : begin + 2048], optimize=True
            )
            root = 1 / np.sqrt(np.repeat(mass[begin : begin + 2048], d, axis=1))
            largest = max(largest, float(np.linalg.eigvalsh(root[:, :, None] * k * root[:, None, :]).max()))
        return 2.0 / np.sqrt(largest)


def _check_mesh(mesh: Any, corners: Reals) -> None:
    """Whether all elements have a volume, with the same orientation at all corners. `corners`: reference positions of their nodes."""
    if not np.isfinite(mesh.p).all():
        raise CouplingError("a node of the mesh is not finite; repair the mesh", "Mesh")
    nodes, d = corners.shape
    places = np.moveaxis(mesh.p[:, mesh.t], [0, 1, 2], [2, 1, 0])
    if nodes == d + 1:
        edges = places[:, 1:] - places[:, :1]
        determinants = np.linalg.det(edges)[:, None]
    else:
        # Derivatives of the products of linear functions at all corners.
        at = np.where(corners[:, None, :] == 1.0, corners[None], 1.0 - corners[None])
        slopes = np.empty((nodes, nodes, d))
        for i in range(d):
            others = np.prod(np.delete(at, i, axis=2), axis=2)
            slopes[:, :, i] = np.where(corners[:, None, i] == 1.0, 1.0, -1.0) * others
        determinants = np.linalg.det(np.einsum("ean,aci->ecni", places, slopes))
    scale = np.ptp(places, axis=1).max(axis=1) ** d
    least = np.abs(determinants).min(axis=1)
    turned = determinants.min(axis=1) * determinants.max(axis=1) <= 0
    bad = turned | (least <= 1e-9 * scale)
    if bad.any():
        element = int(np.nonzero(bad)[0][0])
        raise CouplingError(f"element {element} of the mesh has no volume, or is inverted at a corner; repair the mesh", "Mesh")
