"""ConcorDEM: the discrete element method for cohesive materials.

A scenario describes a run, a simulation computes it, and its state is available as NumPy arrays.

>>> import concordem
>>> scenario = concordem.Scenario(
...     packing={"kind": "spheres", "spheres": [[0, 0, 0, "1 mm"], ["2 mm", 0, 0, "1 mm"]]},
...     material={"name": "glass", "density": "2500 kg/m^3",
...               "linear_bond": {"normal_stiffness": "1e6 N/m", "shear_stiffness": "3e5 N/m"}},
...     bonds={"law": "linear_bond", "interaction_ratio": 1.1},
...     contacts={"law": "none"},
...     stop={"steps": 100},
... )
>>> simulation = scenario.simulation(threads=1)
>>> simulation.state.writable("velocities")[1, 0] = 1e-3
>>> simulation.run()
'steps'
>>> simulation.state.positions.shape, simulation.state.positions.flags.writeable
((2, 3), False)
>>> sorted(simulation.state.contacts())
['linear_bond']

:meth:`Simulation.write` writes a run as the program does, and :class:`Result` reads such files. :func:`check`, :func:`run`, :func:`resume`,
:func:`measure`, :func:`report`, :func:`render`, :func:`export`, :func:`characterise`, :func:`sweep`, and :func:`explain` are the commands of the
program; :func:`figure` is `concordem plot`. :func:`plot`, also a method of simulations and results, draws curves with matplotlib. Tables of scenarios with their types are in
:mod:`concordem.tables`, operators on arrays in :mod:`concordem.operators`, packings in :mod:`concordem.packing`, couplings with finite elements
in :mod:`concordem.coupling`, posteriors of parameters from measured curves in :mod:`concordem.inference`, strain paths of cells for learning in
:mod:`concordem.datasets`, the bridge to YADE in :mod:`concordem.yade`, LIGGGHTS with ConcorDEM laws in :mod:`concordem.liggghts`.
"""

from . import operators, packing, tables
from ._core import (
    Result,
    Scenario,
    Simulation,
    SimulationSnapshot,
    State,
    __version__,
    calibrate_cohesive_beam,
    calibrate_elastic,
    check,
    elastic_constants,
    explain,
    export,
    figure,
    measure,
    render,
    report,
    resume,
    run,
    schema,
    sweep,
)
from ._errors import (
    AssemblyError,
    CalibrationError,
    ConcordemError,
    ConcordemWarning,
    ContinuumError,
    CouplingError,
    InferenceError,
    InternalError,
    MissingFileError,
    OperatorError,
    PackingError,
    Problem,
    ResultError,
    ScenarioError,
    SolverError,
    StaticsError,
    UnstableError,
    YadeError,
)
from ._plot import _method, plot
from ._tables import to_pandas, to_xarray
from ._types import BeamFit, Check, Curve, ElasticAnswers, ElasticConstants, ElasticFit, Forces, Key, MeshState, Summary, Sweep, WallState, units
from .packing import characterise

__all__ = [
    "AssemblyError",
    "BeamFit",
    "CalibrationError",
    "Check",
    "Curve",
    "ConcordemError",
    "ConcordemWarning",
    "ContinuumError",
    "CouplingError",
    "ElasticAnswers",
    "ElasticConstants",
    "ElasticFit",
    "Forces",
    "InferenceError",
    "InternalError",
    "Key",
    "MeshState",
    "MissingFileError",
    "OperatorError",
    "PackingError",
    "Problem",
    "Result",
    "ResultError",
    "Scenario",
    "ScenarioError",
    "Simulation",
    "SimulationSnapshot",
    "SolverError",
    "State",
    "StaticsError",
    "Summary",
    "Sweep",
    "UnstableError",
    "WallState",
    "YadeError",
    "__version__",
    "calibrate_cohesive_beam",
    "calibrate_elastic",
    "characterise",
    "check",
    "elastic_constants",
    "explain",
    "export",
    "figure",
    "measure",
    "operators",
    "packing",
    "plot",
    "render",
    "report",
    "resume",
    "run",
    "schema",
    "sweep",
    "tables",
    "to_pandas",
    "to_xarray",
    "units",
]

# The classes are compiled; plotting is Python.
for _kind in (Simulation, Result):
    setattr(_kind, "plot", _method)
del _kind, _method
