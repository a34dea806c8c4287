"""Materials of finite elements: first Piola-Kirchhoff stress from deformation gradients at integration points."""

from __future__ import annotations

from typing import Any, Protocol, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import CellStates, DamagePlastic, RepresentativeCells
from .._errors import ContinuumError, CouplingError

Reals = NDArray[np.float64]


class Material(Protocol):
    """A material with its own state at n integration points."""

    density: Any
    """Reference density, kg/m^3: one, or one per element."""

    def start(self, sizes: Reals) -> None:
        """Begin with n points in elements of these sizes, m, (n,)."""
        ...

    def stress(self, gradient: Reals) -> Reals:
        """Advance to these deformation gradients, (n, 3, 3); first Piola-Kirchhoff stress P[i, J], Pa, (n, 3, 3)."""
        ...

    def stiffness(self) -> Reals:
        """Elastic stiffness, components 11, 22, 33, 23, 31, 12 with engineering shears, Pa, (6, 6) or (elements, 6, 6), for the
        time step."""
        ...

    def energy(self, gradient: Reals) -> Reals | None:
        """Stored energy per reference volume, J/m^3, (n,); None if the material does not know it."""
        ...

    def save(self) -> Any:
        """The state of all points."""
        ...

    def restore(self, state: Any) -> None:
        """Go back to a state of `save`."""
        ...


def _green(gradient: Reals) -> Reals:
    """Green strain ``E = (F^T F - 1)/2``: zero for rotations."""
    strain: Reals = 0.5 * (np.einsum("pki,pkj->pij", gradient, gradient) - np.eye(3))
    return strain


def _check_positive(**values: float) -> None:
    for name, value in values.items():
        if not (value > 0 and np.isfinite(value)):
            raise ValueError(f"{name} is {value}; it must be positive and finite")


class Elastic:
    """Elasticity in Green strain, ``S = C : E`` and ``P = F S``: small strains, any rotation.

    `young` (Pa) and `poisson`, or a full `stiffness` (Pa, (6, 6)), such as that of a lattice; `density` in kg/m^3.
    """

    def __init__(
        self,
        young: float | None = None,
        poisson: float | None = None,
        density: float = 0.0,
        stiffness: ArrayLike | None = None,
    ) -> None:
        _check_positive(density=density)
        self.density = float(density)
        if stiffness is None:
            if young is None or poisson is None:
                raise ValueError("Elastic needs young and poisson, or stiffness")
            _check_positive(young=young)
            if not -1 < poisson < 0.5:
                raise ValueError(f"poisson is {poisson}; it must be greater than -1 and less than 0.5")
            shear = young / (2 * (1 + poisson))
            lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
            matrix = np.diag([2 * shear] * 3 + [shear] * 3)
            matrix[:3, :3] += lame
        else:
            if young is not None or poisson is not None:
                raise ValueError("Elastic got both stiffness and young or poisson; give one of them")
            matrix = np.array(stiffness, dtype=float)
            if matrix.shape != (6, 6) or not np.allclose(matrix, matrix.T, rtol=1e-9, atol=1e-9 * abs(matrix).max()):
                raise ValueError("stiffness must be a symmetric matrix of shape (6, 6)")
            if np.linalg.eigvalsh(matrix)[0] <= 0:
                raise ValueError("stiffness must be positive definite")
        self._matrix = matrix

    def start(self, sizes: Reals) -> None:
        """Nothing to remember."""

    def _second(self, gradient: Reals) -> tuple[Reals, Reals]:
        strain = _green(gradient)
        components = _to_components(strain, 2.0)
        return strain, _to_tensor(components @ self._matrix.T)

    def stress(self, gradient: Reals) -> Reals:
        """First Piola-Kirchhoff stress, Pa."""
        _, second = self._second(gradient)
        return gradient @ second

    def stiffness(self) -> Reals:
        """Stiffness, Pa."""
        return self._matrix

    def energy(self, gradient: Reals) -> Reals | None:
        """Stored energy, J/m^3."""
        strain, second = self._second(gradient)
        density: Reals = 0.5 * np.einsum("pij,pij->p", strain, second)
        return density

    def save(self) -> Any:
        """Nothing."""
        return None

    def restore(self, state: Any) -> None:
        """Nothing to do."""


class Damaging:
    """The damage-plastic model in Green strain: small strains, any rotation.

    `states`: of the points at the start, (n, 8), from :meth:`DamagePlastic.hand_over`; points without history by default.
    """

    def __init__(self, law: DamagePlastic, density: float, states: ArrayLike | None = None) -> None:
        _check_positive(density=density)
        self.density = float(density)
        self.law = law
        self._given = None if states is None else np.array(states, dtype=float)
        self.states: Reals = np.zeros((0, 8))
        self.damage: Reals = np.zeros(0)
        self._sizes: Reals = np.zeros(0)

    def start(self, sizes: Reals) -> None:
        """Check that elements do not snap back, and that the given states fit."""
        largest = self.law.largest_size
        if sizes.size and sizes.max() >= largest:
            message = f"an element measures {sizes.max():.3g} m; above {largest:.3g} m the damage-plastic model snaps back: refine the mesh"
            raise ContinuumError(message, "Parameter")
        self._sizes = sizes
        self.states = np.zeros((len(sizes), 8)) if self._given is None else self._given.copy()
        if self.states.shape != (len(sizes), 8):
            raise ValueError(f"states has shape {self.states.shape}; give one row per integration point, ({len(sizes)}, 8)")
        self.damage = np.array([self.law.damage(state[7], size) for state, size in zip(self.states, sizes, strict=True)])

    def stress(self, gradient: Reals) -> Reals:
        """First Piola-Kirchhoff stress, Pa."""
        update = self.law.update(_green(gradient), self.states, self._sizes, tangent=False)
        self.states, self.damage = update.state, update.damage
        return gradient @ update.stress

    def stiffness(self) -> Reals:
        """Stiffness without damage, Pa."""
        p = self.law.parameters
        return Elastic(p["young"], p["poisson"], self.density).stiffness()

    def energy(self, gradient: Reals) -> Reals | None:
        """Unknown: most of the work is dissipated."""
        return None

    def save(self) -> Any:
        """States and damage."""
        return self.states.copy(), self.damage.copy()

    def restore(self, state: Any) -> None:
        """Go back."""
        self.states, self.damage = state[0].copy(), state[1].copy()


class CellMaterial:
    """A periodic cell of particles at each integration point (Stránský 2018, section 5.3).

    `steps`: steps of the cells per step of the elements. The cells have their own inertia and damping, so the time of the elements
    and that of the cells need not agree; `steps` says how often the cells are computed. `density`: of the elements, kg/m^3; that of
    the cells by default.
    """

    def __init__(self, cells: RepresentativeCells, steps: int = 1, density: float | None = None) -> None:
        if steps < 1:
            raise ValueError(f"steps is {steps}; give at least 1")
        self.cells, self.steps = cells, int(steps)
        self.density = float(cells.density[0]) if density is None else float(density)
        _check_positive(density=self.density)
        self._matrix: Reals = cells.stiffness()[0]
        self.cauchy: Reals = np.zeros((len(cells), 3, 3))

    def start(self, sizes: Reals) -> None:
        """One cell per point."""
        if len(sizes) != len(self.cells):
            raise CouplingError(f"{len(self.cells)} cells for {len(sizes)} integration points; build one cell per point", "Count")

    def stress(self, gradient: Reals) -> Reals:
        """First Piola-Kirchhoff stress ``P = J s F^-T`` of the cells' Cauchy stress s, Pa."""
        self.cells.deform(gradient, self.steps)
        # Position first in the cells; force first here.
        self.cauchy = self.cells.response().stress.transpose(0, 2, 1)
        volume = np.linalg.det(gradient)
        return volume[:, None, None] * self.cauchy @ np.linalg.inv(gradient).transpose(0, 2, 1)

    def tangent(self, gradient: Reals, difference: float = 1e-6) -> Reals:
        """Derivative ``A[i, J, k, L] = dP[i, J]/dF[k, L]`` of the stress that :meth:`stress` would return at these gradients, Pa,
        (n, 3, 3, 3, 3), by central differences.

        The states of the cells do not change. It is the tangent of this one step: of the path in `steps` steps of the cells, with their
        inertia and damping. `difference`: of the components of F. The error is of the order of its square, and rounding divided by it;
        where a bond begins to soften within it, the result is the mean of loading and unloading.
        """
        if not 0 < difference < 1e-2:
            raise ValueError(f"difference is {difference}; it must be positive and less than 0.01")
        state = self.save()
        result = np.empty((len(gradient), 3, 3, 3, 3))
        try:
            for k in range(3):
                for j in range(3):
                    sides = []
                    for sign in (1.0, -1.0):
                        changed = np.array(gradient)
                        changed[:, k, j] += sign * difference
                        sides.append(self.stress(changed))
                        self.restore(state)
                    result[..., k, j] = (sides[0] - sides[1]) / (2 * difference)
        finally:
            self.restore(state)
        return result

    def stiffness(self) -> Reals:
        """Elastic stiffness of the cells at the start, Pa."""
        return self._matrix

    def energy(self, gradient: Reals) -> Reals | None:
        """Unknown; see :attr:`CellResponse.work`."""
        return None

    def save(self) -> Any:
        """States of the cells."""
        return self.cells.save(), self.cauchy.copy()

    def restore(self, state: Any) -> None:
        """Go back."""
        saved: CellStates = state[0]
        self.cells.restore(saved)
        self.cauchy = state[1].copy()


class Layers:
    """Different materials in different elements.

    `materials`, and `of`: the index of the material of each element, (elements,).
    """

    def __init__(self, materials: Sequence[Material], of: ArrayLike) -> None:
        self.materials = list(materials)
        self._of = np.asarray(of)
        if self._of.ndim != 1 or not np.issubdtype(self._of.dtype, np.integer):
            raise ValueError("of must be one index per element")
        missing = set(range(len(self.materials))) ^ set(np.unique(self._of).tolist())
        if missing:
            raise ValueError(f"of and materials do not fit: {sorted(missing)} occurs in one of them only")
        self.density: Reals = np.array([material.density for material in self.materials], dtype=float)[self._of]
        self._points: list[NDArray[np.int64]] = []

    def start(self, sizes: Reals) -> None:
        """Begin with the points of each material."""
        if len(sizes) % len(self._of):
            raise CouplingError(f"{len(self._of)} elements, but {len(sizes)} integration points; give one index per element", "Count")
        of = np.repeat(self._of, len(sizes) // len(self._of))
        self._points = [np.nonzero(of == k)[0] for k in range(len(self.materials))]
        for material, points in zip(self.materials, self._points, strict=True):
            material.start(sizes[points])

    def stress(self, gradient: Reals) -> Reals:
        """First Piola-Kirchhoff stress, Pa."""
        stress = np.empty_like(gradient)
        for material, points in zip(self.materials, self._points, strict=True):
            stress[points] = material.stress(gradient[points])
        return stress

    def stiffness(self) -> Reals:
        """Stiffness of each element, Pa, (elements, 6, 6)."""
        matrices: Reals = np.stack([material.stiffness() for material in self.materials])[self._of]
        return matrices

    def energy(self, gradient: Reals) -> Reals | None:
        """Stored energy, if all materials know it."""
        energy = np.empty(len(gradient))
        for material, points in zip(self.materials, self._points, strict=True):
            part = material.energy(gradient[points])
            if part is None:
                return None
            energy[points] = part
        return energy

    def save(self) -> Any:
        """The states of all materials."""
        return [material.save() for material in self.materials]

    def restore(self, state: Any) -> None:
        """Go back."""
        for material, saved in zip(self.materials, state, strict=True):
            material.restore(saved)


_ORDER = [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)]


def _to_components(tensor: Reals, shear: float) -> Reals:
    factors = [1.0] * 3 + [shear] * 3
    return np.stack([factor * tensor[:, i, j] for factor, (i, j) in zip(factors, _ORDER, strict=True)], axis=1)


def _to_tensor(components: Reals) -> Reals:
    tensor = np.empty((len(components), 3, 3))
    for k, (i, j) in enumerate(_ORDER):
        tensor[:, i, j] = tensor[:, j, i] = components[:, k]
    return tensor
