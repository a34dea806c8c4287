"""What the bonded engines add to O.engines, which scripts do not see: their own PyRunners, and helpers of engines that read interactions.

O.engines keeps the numbers that a script has written (``O.engines[3].damping = 0.2``): the PyRunners of the bonded engines stand behind
InteractionLoop, whatever a script assigns. An engine of YADE that reads interactions walks through YADE's container in C++. In O.engines, it stands between two helpers: the first one lends the bonds to the
container (:class:`._container.Loan`), the second one takes them back. Scripts do not see the helpers in O.engines, so the numbers of the
engines stay those of the script. What an engine reads costs as much as a loop over the interactions in a script; the bonds are lent only in
steps in which the engine may act.
"""

from __future__ import annotations

import time
from typing import Any, Callable, Sequence

from . import _rules
from ._container import Loan
from ._rules import is_a
from ._scene import host, is_at_rest

#: Beginning of the commands of helpers.
_COMMAND = "__import__('concordem.yade').yade._lending."
_loan: Loan | None = None
#: Set by the hooks: the bonded engines whose bonds are not in O.interactions, the commands of their PyRunners, and O.engines with all that is added.
owners: Callable[[], Sequence[Any]] = list
commands: Callable[[], set[str]] = set
raw_engines: Callable[[], list[Any]] = lambda: list(host().omega.engines)
#: Numbers of helpers of GlobalStiffnessTimeStepper that have acted since O.engines was last assigned.
_acted: set[int] = set()


def is_helper(engine: Any) -> bool:
    """Whether an engine is one of the helpers."""
    return type(engine).__name__ == "PyRunner" and engine.command.startswith(_COMMAND)


def working_engines() -> list[Any]:
    """O.engines with the PyRunners of bonded engines, without the helpers."""
    return [engine for engine in raw_engines() if not is_helper(engine)]


def of_script(engines: Sequence[Any]) -> list[Any]:
    """The engines that a script has put there."""
    ours = commands()
    return [engine for engine in engines if not is_helper(engine) and getattr(engine, "command", None) not in ours]


def with_ours(engines: Sequence[Any]) -> list[Any]:
    """The engines of a script with the PyRunners of the bonded engines behind InteractionLoop, and each engine that reads interactions between
    its helpers if a bonded engine of the scene has bonds that YADE can read."""
    _acted.clear()
    plain, ours = of_script(engines), commands()
    # Without an InteractionLoop, the check before the next step refuses the scene.
    place = next((k for k, engine in enumerate(plain) if is_a(engine, "InteractionLoop")), len(plain)) + 1
    plain[place:place] = [engine for engine in raw_engines() if getattr(engine, "command", None) in ours]
    if not any(engine.lends for engine in owners()):
        return plain
    found = []
    for number, engine in enumerate(plain):
        found += [_helper(f"lend({number})"), engine, _helper("take_back()")] if _rules.is_followed(engine) else [engine]
    return found


def _helper(call: str) -> Any:
    return host().wrapper.PyRunner(command=_COMMAND + call, iterPeriod=1, initRun=True, firstIterRun=0)


def _may_act(engine: Any, number: int) -> bool:
    """Whether an engine may read interactions in this step; True if that is not certain."""
    omega = host().omega
    if engine.dead:
        return False
    if is_a(engine, "PeriodicEngine"):
        if 0 <= engine.nDo <= engine.nDone:
            return False
        if engine.nDone == 0 or engine.realPeriod > 0 or omega.iter < engine.iterLast:
            return True
        return bool(
            0 < engine.iterPeriod <= omega.iter - engine.iterLast or (engine.virtPeriod > 0 and omega.time - engine.virtLast >= 0.999 * engine.virtPeriod)
        )
    if is_a(engine, "GlobalStiffnessTimeStepper"):
        if not engine.active:
            return False
        if number in _acted and omega.iter >= 2 and omega.iter % engine.timeStepUpdateInterval:
            return False
        _acted.add(number)
    elif is_a(engine, "PeriTriaxController"):
        certain = engine.dynCell or not min(engine.stiff) > 0 or not engine.currUnbalanced >= 0
        return bool(certain or omega.iter % engine.globUpdate == 0)
    return True


def lend(number: int) -> None:
    """Lend the bonds to the engine behind this helper, which comes next in the step; called by the helper."""
    global _loan
    engines, mine = raw_engines(), f"{_COMMAND}lend({number})"
    place = next(k for k, engine in enumerate(engines) if is_helper(engine) and engine.command == mine)
    if not _may_act(engines[place + 1], number):
        return
    found = [engine for engine in owners() if engine.lends]
    if not found:
        return
    if is_a(engines[place + 1], "CpmStateUpdater"):
        for engine in found:
            engine.update_lost()
    settle()
    _loan = Loan(found, stiffness=is_a(engines[place + 1], "GlobalStiffnessTimeStepper"))


def take_back() -> None:
    """Take the bonds back; called by the helper."""
    settle()


def settle() -> None:
    """End the loan. A script that an engine calls (a `doneHook`), and one in another thread, find the bonds only once."""
    global _loan
    if _loan is None:
        return
    # The engine in the loop's thread reads what was lent.
    end = time.monotonic() + 60
    while not is_at_rest() and _loan is not None and time.monotonic() < end:
        time.sleep(1e-5)
    loan, _loan = _loan, None
    if loan is not None:
        loan.end()
