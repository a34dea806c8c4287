"""A periodic cell as the micro simulation of the Micro Manager of preCICE."""

from __future__ import annotations

from typing import Any, Mapping

import numpy as np

from .._core import RepresentativeCells, Scenario
from .._errors import CouplingError
from ._materials import CellMaterial, _to_components, _to_tensor
from ._protocol import Reals

_STRAINS = ("strains1to3", "strains4to6")
_STRESSES = ("stresses1to3", "stresses4to6")


def micro_simulation(scenario: Scenario, steps: int = 1, tangent: bool = False) -> type:
    """The class `MicroSimulation` of a module for the Micro Manager: each integration point of the macro code gets a cell of `scenario`.

    Data of preCICE, vectors of three: ``strains1to3`` and ``strains4to6`` in, ``stresses1to3`` and ``stresses4to6`` (Pa) out; components
    11, 22, 33, 23, 31, 12, small strains with engineering shears, Cauchy stress. With `tangent`, also ``cmat1`` to ``cmat7``: the upper
    triangle of the derivative of the stress, row by row, Pa. `steps`: steps of the cell per call.

    A module for the Micro Manager then reads::

        from concordem import Scenario, coupling
        MicroSimulation = coupling.micro_simulation(Scenario.from_file("cell.toml"), steps=100)
    """

    class MicroSimulation:
        """One cell."""

        def __init__(self, sim_id: int = 0, *_: Any) -> None:
            self._id = int(sim_id)
            self._material = CellMaterial(RepresentativeCells(scenario, 1, threads=1), steps)

        def get_global_id(self) -> int:
            """Number of the simulation."""
            return self._id

        def set_global_id(self, global_id: int) -> None:
            """Change the number of the simulation."""
            self._id = int(global_id)

        def solve(self, macro_data: Mapping[str, Any], dt: float) -> dict[str, Reals]:
            """Deform the cell to the strain of the macro code."""
            missing = [name for name in _STRAINS if name not in macro_data]
            if missing:
                raise CouplingError(f"the macro code gives no {missing[0]}; its data are {sorted(macro_data)}", "Data")
            strain = np.concatenate([np.asarray(macro_data[name], dtype=float).ravel() for name in _STRAINS])
            if strain.shape != (6,) or not np.isfinite(strain).all():
                raise CouplingError(f"the strain is {strain}; give two vectors of three finite numbers", "Data")
            if not dt > 0:
                raise CouplingError(f"the time step is {dt}; it must be positive", "TimeStep")
            result: dict[str, Reals] = {}
            if tangent:
                matrix = self._matrix(strain)[np.triu_indices(6)]
                result |= {f"cmat{k + 1}": matrix[3 * k : 3 * k + 3] for k in range(7)}
            stress = self._stress(strain)
            return {_STRESSES[0]: stress[:3], _STRESSES[1]: stress[3:]} | result

        def _stress(self, strain: Reals) -> Reals:
            """Cauchy stress at a strain."""
            engineering = np.concatenate([strain[:3], 0.5 * strain[3:]])
            self._material.stress(np.eye(3) + _to_tensor(engineering[None]))
            cauchy = self._material.cauchy
            components: Reals = _to_components(0.5 * (cauchy + cauchy.transpose(0, 2, 1)), 1.0)[0]
            return components

        def _matrix(self, strain: Reals, difference: float = 1e-6) -> Reals:
            """Derivative of the stress by central differences, made symmetric; the state does not change."""
            state = self.get_state()
            columns = []
            for k in range(6):
                sides = []
                for sign in (1.0, -1.0):
                    changed = strain.copy()
                    changed[k] += sign * difference
                    sides.append(self._stress(changed))
                    self.set_state(state)
                columns.append((sides[0] - sides[1]) / (2 * difference))
            matrix = np.stack(columns, axis=1)
            result: Reals = 0.5 * (matrix + matrix.T)
            return result

        def get_state(self) -> Any:
            """The complete state."""
            return self._material.save()

        def set_state(self, state: Any) -> None:
            """Go back to a state of `get_state`."""
            self._material.restore(state)

    return MicroSimulation
