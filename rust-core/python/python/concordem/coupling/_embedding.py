"""Points that move with finite elements, and the forces on them as forces on the nodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._errors import CouplingError
from ._protocol import Reals, _vectors, cross

# Corners of the reference elements, in the order of VTK.
_CORNERS: dict[int, list[list[float]]] = {
    4: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    8: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
}
# Distance outside an element up to which a point counts as inside, in element sizes: rounding of coordinates.
_OUTSIDE = 1e-9


class Embedding:
    """Points fixed in the material of tetrahedra or hexahedra of first order.

    A point has the shape functions N_a of its element at its place. It moves and rotates with the element,

    ``x = sum of N_a x_a``, ``v = sum of N_a v_a``, ``w = 1/2 sum of grad N_a x v_a`` (half the curl),

    with the gradient in the present configuration. Force F and moment M on a point become the nodal forces

    ``f_a = N_a F + 1/2 M x grad N_a``,

    which have the same sum, the same moment about every point, and the same power (``sum of N_a = 1``, ``sum of x_a grad N_a = 1``).

    Args:
        nodes: reference positions, m, (n, 3).
        cells: nodes of each element, (m, 4) tetrahedra or (m, 8) hexahedra, numbered as in VTK.
        points: reference positions, m, (k, 3). Raises CouplingError for points in no element.
    """

    def __init__(self, nodes: ArrayLike, cells: ArrayLike, points: ArrayLike) -> None:
        self.nodes = _vectors("nodes", nodes, None)
        table = np.asarray(cells)
        if table.ndim != 2 or table.shape[1] not in _CORNERS or not np.issubdtype(table.dtype, np.integer):
            raise ValueError(f"cells has shape {table.shape} and type {table.dtype}; give integers, (m, 4) or (m, 8)")
        if table.size == 0 or table.min() < 0 or table.max() >= len(self.nodes):
            raise ValueError(f"cells must name nodes from 0 to {len(self.nodes) - 1}")
        self._corners = np.array(_CORNERS[table.shape[1]], dtype=float)
        places = _vectors("points", points, None)
        self.element: NDArray[np.int64] = np.empty(len(places), dtype=np.int64)
        """Element of each point, (k,)."""
        local = np.empty_like(places)
        low, high = self.nodes[table].min(axis=1), self.nodes[table].max(axis=1)
        margin = 1e-6 * (high - low).max(axis=1, keepdims=True)
        for k, place in enumerate(places):
            near = np.nonzero(((place >= low - margin) & (place <= high + margin)).all(axis=1))[0]
            at = self._invert(self.nodes[table[near]], place)
            outside = np.maximum(-at.min(axis=1), at.sum(axis=1) - 1 if len(self._corners) == 4 else at.max(axis=1) - 1)
            # Newton's method may diverge for elements that the point is not in.
            outside = np.where(np.isfinite(outside), outside, np.inf)
            if len(near) == 0 or outside.min() > _OUTSIDE:
                text = ", ".join(f"{x:.6g}" for x in place)
                raise CouplingError(f"point {k} at ({text}) m lies in no element; enlarge the mesh, or take the point away", "Outside")
            best = int(np.argmin(outside))
            self.element[k], local[k] = near[best], at[best]
        self.cells: NDArray[np.int64] = table[self.element].astype(np.int64)
        """Nodes of the element of each point, (k, 4) or (k, 8)."""
        self.weights: Reals
        self.weights, self._slopes = self._shape(local)
        """Shape functions at the points, (k, 4) or (k, 8)."""

    def _shape(self, at: Reals) -> tuple[Reals, Reals]:
        """Shape functions and their derivatives at local coordinates (k, 3)."""
        if len(self._corners) == 4:
            values = np.concatenate([1 - at.sum(axis=1, keepdims=True), at], axis=1)
            slopes = np.broadcast_to(np.vstack([-np.ones(3), np.eye(3)]), (len(at), 4, 3))
            return values, slopes
        one = self._corners[None] == 1.0
        factor = np.where(one, at[:, None, :], 1.0 - at[:, None, :])
        sign = np.where(one, 1.0, -1.0)
        slopes = np.stack([sign[..., i] * np.delete(factor, i, axis=2).prod(axis=2) for i in range(3)], axis=2)
        return factor.prod(axis=2), slopes

    def _invert(self, corners: Reals, place: Reals) -> Reals:
        """Local coordinates of a place in elements with these corners (m, 8, 3), by Newton's method."""
        at = np.full((len(corners), 3), 0.25)
        with np.errstate(all="ignore"):
            # One step for a tetrahedron or a brick; distorted hexahedra converge quadratically.
            for _ in range(30):
                values, slopes = self._shape(at)
                gap = np.einsum("ma,mai->mi", values, corners) - place
                jacobian = np.einsum("mai,maj->mij", corners, slopes)
                jacobian[~(np.abs(np.linalg.det(jacobian)) > 0)] = np.nan
                change = np.linalg.solve(jacobian, gap[..., None])[..., 0]
                at = at - change
                if not (np.abs(change) > 1e-14).any():
                    break
        return at

    def positions(self, displacement: ArrayLike) -> Reals:
        """Positions of the points at these displacements of the nodes (m), m, (k, 3)."""
        return self._mean(self.nodes + _vectors("displacement", displacement, len(self.nodes)))

    def _mean(self, values: Reals) -> Reals:
        result: Reals = np.einsum("ka,kai->ki", self.weights, values[self.cells])
        return result

    def gradients(self, displacement: ArrayLike) -> Reals:
        """Gradients of the shape functions in the present configuration, 1/m, (k, 4 or 8, 3).

        Raises CouplingError if an element is inverted at a point.
        """
        present = self.nodes + _vectors("displacement", displacement, len(self.nodes))
        jacobian = np.einsum("kai,kaj->kij", present[self.cells], self._slopes)
        first = np.einsum("kai,kaj->kij", self.nodes[self.cells], self._slopes)
        inverted = np.linalg.det(jacobian) * np.linalg.det(first) <= 0
        if inverted.any():
            worst = int(self.element[np.nonzero(inverted)[0][0]])
            raise CouplingError(f"element {worst} is inverted; use a finer mesh, smaller loads, or a smaller time step", "Inverted")
        result: Reals = np.einsum("kaj,kji->kai", self._slopes, np.linalg.inv(jacobian))
        return result

    def motion(self, velocity: ArrayLike, gradients: Reals) -> tuple[Reals, Reals]:
        """Velocities (m/s) and angular velocities (rad/s) of the points for velocities of the nodes, (k, 3) each."""
        nodal = _vectors("velocity", velocity, len(self.nodes))
        return self._mean(nodal), 0.5 * cross(gradients, nodal[self.cells]).sum(axis=1)

    def distribute(self, force: ArrayLike, moment: ArrayLike, gradients: Reals) -> Reals:
        """Nodal forces (N) of forces (N) and moments (N m) on the points, (n, 3)."""
        count = len(self.cells)
        pull, couple = _vectors("force", force, count), _vectors("moment", moment, count)
        local = self.weights[..., None] * pull[:, None, :] + 0.5 * cross(couple[:, None, :], gradients)
        result = np.empty_like(self.nodes)
        for i in range(3):
            result[:, i] = np.bincount(self.cells.ravel(), weights=local[..., i].ravel(), minlength=len(result))
        return result


def spins_of(places: Reals, velocities: Reals) -> Reals:
    """Angular velocities of groups of n points, rad/s, (k, 3): ``w = T^-1 sum of r x v``, those of the rigid bodies nearest to the motion.

    `places`, m, and `velocities`, m/s: (k, n, 3). r: from the middle of the group, ``T = sum of (r.r 1 - r r)``.
    """
    arms, inverse = _arms_of(places)
    spins: Reals = np.einsum("kij,kj->ki", inverse, cross(arms, velocities).sum(axis=1))
    return spins


def couples_of(places: Reals, moments: Reals) -> Reals:
    """Moments (N m, (k, 3)) on groups of n points (m, (k, n, 3)) as forces on the points, ``T^-1 M x r``, N, (k, n, 3).

    Their sum is zero, their moment M; in a motion with the spin w of `spins_of` their power is M.w.
    """
    arms, inverse = _arms_of(places)
    forces: Reals = cross(np.einsum("kij,kj->ki", inverse, moments)[:, None, :], arms)
    return forces


def _arms_of(places: Reals) -> tuple[Reals, Reals]:
    """Vectors r from the middle of each group of n points to them, m, (k, n, 3), and the inverse of ``T = sum of (r.r 1 - r r)``, 1/m^2,
    (k, 3, 3)."""
    arms = places - places.mean(axis=1, keepdims=True)
    square = np.einsum("kci,kci->k", arms, arms)
    tensor = square[:, None, None] * np.eye(3) - np.einsum("kci,kcj->kij", arms, arms)
    return arms, np.linalg.inv(tensor)


def _cells_of(elements: Any) -> NDArray[np.int64]:
    """Elements of a mesh of scikit-fem, numbered as in VTK."""
    mesh: Any = getattr(elements, "mesh", None)
    kind = type(mesh).__name__
    if kind not in ("MeshHex1", "MeshTet1"):
        raise ValueError(f"the mesh is a {kind}; give cells, or elements in space (MeshHex, MeshTet)")
    table = mesh.t.T.astype(np.int64)
    corners: Reals = np.array(mesh.elem().doflocs, dtype=np.float64)
    # The corner of scikit-fem at each corner of VTK.
    order = [int(np.nonzero((corners == corner).all(axis=1))[0][0]) for corner in _CORNERS[len(corners)]]
    cells: NDArray[np.int64] = table[:, order]
    return cells
