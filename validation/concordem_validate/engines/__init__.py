"""The engines. Each module translates a scenario and the exported start state, and raises Unsupported for what it cannot translate.

An engine has `NAME`, `version()` (raises NotInstalled), and `run(task, folder, limit) -> Result`. To add one, write a module and list
it in `ENGINES`.
"""
from . import analytic, concordem, esys, lammps, liggghts, table, yade

ENGINES = {engine.NAME: engine for engine in (concordem, yade, liggghts.ONE, liggghts.TWO, lammps, esys, analytic, table)}
