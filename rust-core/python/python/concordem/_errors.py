"""Exceptions, one class per stage of the solver, and warnings. Messages give the problem, its position, and the remedy."""

from __future__ import annotations

from typing import Any, NamedTuple, Sequence


class Problem(NamedTuple):
    """One problem in a scenario."""

    kind: str
    """Class of the problem: "UnknownKey", "WrongUnit", "OutOfRange", ..."""
    key: str
    """Key, such as "material[0].cpm.young" (counted from 0); empty for the file as a whole."""
    value: str | None
    """The offending value, as written."""
    line: int
    """Line of the text, from 1."""
    column: int
    """Column, from 1."""
    message: str
    """Description of the problem."""
    help: str
    """Remedy."""


class ConcordemWarning(UserWarning):
    """A scenario is valid, but may not do what its author expects."""

    def __init__(self, message: str, problem: Sequence[Any] | None = None) -> None:
        super().__init__(message)
        self.problem = None if problem is None else Problem(*problem)
        """The doubtful key, with its position in the text and the remedy."""


class ConcordemError(Exception):
    """Base of all exceptions of this package."""

    # Without fields of its own, a class can become the base of another one later; see `InternalError`.
    __slots__ = ()

    def __init__(self, message: str, kind: str = "") -> None:
        super().__init__(message)
        self.kind = kind
        """Class of the error within its stage, e.g. "NotFinite"."""


class ScenarioError(ConcordemError, ValueError):
    """A scenario is invalid. `problems` lists all problems; attributes such as `key` and `line` belong to the first one."""

    def __init__(self, message: str, file: str, problems: Sequence[Any]) -> None:
        self.file = file
        """Name of the file, or its substitute in messages."""
        self.problems = [Problem(*problem) for problem in problems]
        """All problems, in the order of the text."""
        super().__init__(message, self.problems[0].kind)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.file, self.problems)

    @property
    def key(self) -> str:
        """Key of the first problem."""
        return self.problems[0].key

    @property
    def value(self) -> str | None:
        """Value of the first problem, as written."""
        return self.problems[0].value

    @property
    def line(self) -> int:
        """Line of the first problem."""
        return self.problems[0].line

    @property
    def help(self) -> str:
        """Remedy for the first problem."""
        return self.problems[0].help


class UnstableError(ScenarioError):
    """A scenario is unstable: the time step is too large, or the particles are too soft."""


class AssemblyError(ConcordemError, ValueError):
    """A scenario cannot be built."""


class PackingError(ConcordemError, ValueError):
    """A packing cannot be generated or read."""


class OperatorError(ConcordemError, ValueError):
    """Invalid input of an operator."""


class SolverError(ConcordemError, RuntimeError):
    """The calculation cannot continue."""


class StaticsError(ConcordemError, RuntimeError):
    """A static problem has no solution."""


class CalibrationError(ConcordemError, RuntimeError):
    """No parameters give the requested properties."""


class ResultError(ConcordemError, RuntimeError):
    """A result or checkpoint cannot be read or written."""


class MissingFileError(ResultError, FileNotFoundError):
    """A result, a checkpoint, or another file does not exist."""


class ContinuumError(ConcordemError, ValueError):
    """A continuum law or a representative cell cannot answer: parameters, strains, or states out of range, or no convergence."""


class CouplingError(ConcordemError, RuntimeError):
    """A coupled calculation cannot continue, or its two sides do not fit."""


class InferenceError(ConcordemError, ValueError):
    """An ensemble, a measured curve, or a prior does not fit, or strain paths cannot be made."""


class InternalError(ConcordemError, RuntimeError):
    """An internal error; please report it. A simulation in which it occurs during a step cannot be used any more."""

    # The library makes this the base of the class that pyo3 raises for panics.
    __slots__ = ()

    def __init__(self, message: str, kind: str = "Panic") -> None:
        note = "(internal error; please report it with the scenario)"
        super().__init__(message if message.endswith(note) else f"{message} {note}".strip(), kind)

    def __reduce__(self) -> tuple[Any, ...]:
        return InternalError, (str(self), self.kind)


class YadeError(ConcordemError, RuntimeError):
    """The bridge does not support this YADE, this scene, or the scene's current state."""
