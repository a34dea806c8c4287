"""`O.pause` that ends the run between two steps.

YADE's own `O.pause` only asks the run to end: the present step goes on, and another one may begin, while `O.running` is already False.
A script that reads the scene or resets it at once meets a step under way: it finds a torn state, or YADE crashes. Here `O.pause` moves
`O.stopAtIter` to the end of the next step and waits for it. Called from a PyRunner, it ends the run after the present step.

Engines of YADE in C++ (PeriIsoCompressor, TriaxialCompressionEngine, KinemC engines, ...) call YADE's own pause in the middle of a step.
Therefore `O.run(n, True)` and `O.wait` do not return until that step has ended. `O.running` stays YADE's: after an error within a step, YADE
looks as if the step went on, so a script that asks in a loop would never end.
"""

from __future__ import annotations

import functools
import threading
import time
from typing import Any

#: The stopAtIter that a pause within a step has set, and the one to restore.
_changed: tuple[int, int] | None = None
#: Longest wait for a step that an engine has paused, s: an error within that step would look as if it went on.
LONGEST_STEP = 60.0


#: The thread within `O.step`, which some versions of YADE run in the thread that calls it.
stepping: int | None = None


def in_the_loop() -> bool:
    """Whether YADE's loop has called this script and waits for it. Its thread is that of `O.step`, or one that Python has not started and has
    a dummy for."""
    return threading.get_ident() == stepping or type(threading.current_thread()).__name__ == "_DummyThread"


def step_under_way(omega: Any) -> bool:
    """Whether YADE's loop, which does not wait for this script, is within a step."""
    # Outside of steps, subStep is -1; with subStepping, it counts engines between the steps of a debugger.
    return omega.subStep >= 0 and not omega.subStepping and not in_the_loop()


def _end_of_step(omega: Any) -> None:
    """Wait for the end of the present step."""
    end = time.monotonic() + LONGEST_STEP
    while step_under_way(omega) and time.monotonic() < end:
        time.sleep(2e-4)


def restore(omega: Any) -> None:
    """Give `O.stopAtIter` the value back that it had before a PyRunner paused the run."""
    global _changed
    if _changed is not None:
        ours, before = _changed
        _changed = None
        # YADE sets -1 when a run has reached it.
        if omega.stopAtIter in (ours, -1):
            omega.stopAtIter = before


def _end_between_steps(omega: Any) -> None:
    """Let the run end between two steps, and wait for it."""
    before, margin = omega.stopAtIter, 1
    try:
        while omega.running:
            now = omega.iter
            goal = before if now < before <= now + margin else now + margin
            omega.stopAtIter = goal
            # The run may have passed the goal before it was set; it does not stop then.
            while omega.running and omega.iter <= goal:
                time.sleep(2e-4)
            margin *= 2
    finally:
        omega.stopAtIter = before


def install() -> None:
    """Replace `O.pause`, and let `O.run` and `O.wait` wait for the end of the step and restore `O.stopAtIter`; once per process."""
    import yade.wrapper

    omega = yade.wrapper.Omega
    if getattr(omega.pause, "ends_between_steps", False):
        return
    pause, run, wait = omega.pause, omega.run, omega.wait

    @functools.wraps(pause)
    def patient_pause(self: Any) -> None:
        global _changed
        if not self.running:
            pause(self)
        elif in_the_loop():
            restore(self)
            _changed = self.iter + 1, self.stopAtIter
            self.stopAtIter = self.iter + 1
        else:
            _end_between_steps(self)

    @functools.wraps(run)
    def restoring_run(self: Any, nSteps: int = -1, wait: bool = False) -> None:
        if not self.running:
            restore(self)
        run(self, nSteps, wait)
        if wait:
            _end_of_step(self)
            restore(self)

    @functools.wraps(wait)
    def restoring_wait(self: Any) -> None:
        wait(self)
        _end_of_step(self)
        restore(self)

    patient_pause.ends_between_steps = True  # type: ignore[attr-defined]
    omega.pause, omega.run, omega.wait = patient_pause, restoring_run, restoring_wait
