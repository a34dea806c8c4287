"""Analytical solutions: a function `analytic(task)` in the case's `case.py`, independent of the solver."""
from ..errors import HarnessError

NAME = "analytic"


def version():
    return "closed forms"


def run(task, folder, limit):
    function = getattr(task.module, "analytic", None)
    if function is None:
        raise HarnessError(f"{task.folder / 'case.py'} has no function `analytic`; add it")
    result = function(task)
    result.provenance.setdefault("source", f"{task.case}/case.py")
    return result
