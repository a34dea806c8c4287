"""Exceptions. They mirror the errors of the solver: what is wrong, where, and what to do."""

from __future__ import annotations

from typing import Any, NamedTuple, Sequence


class Problem(NamedTuple):
    """One thing wrong with a scenario."""

    kind: str
    """Class of the problem: "UnknownKey", "WrongUnit", "OutOfRange", ..."""
    key: str
    """Where: "material[0].cpm.young"; empty for the file as a whole. Counted from 0."""
    value: str | None
    """The offending value, as written."""
    line: int
    """Line of the text, from 1."""
    column: int
    """Column, from 1."""
    message: str
    """What is wrong."""
    help: str
    """What to do."""


class ConcordemError(Exception):
    """Base of all exceptions of this package."""

    def __init__(self, message: str, kind: str = "") -> None:
        super().__init__(message)
        self.kind = kind
        """Class of the error within its stage, e.g. "NotFinite"."""


class ScenarioError(ConcordemError, ValueError):
    """A scenario is wrong. All problems found are in `problems`; the first one's parts are attributes."""

    def __init__(self, message: str, file: str, problems: Sequence[Any]) -> None:
        self.file = file
        """Name of the file, or what stands for it."""
        self.problems = [Problem(*problem) for problem in problems]
        """Everything found wrong, in the order of the text."""
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
        """What to do about the first problem."""
        return self.problems[0].help


class UnstableError(ScenarioError):
    """A scenario asks for something unstable: too large a time step, too soft particles."""


class AssemblyError(ConcordemError, ValueError):
    """A scenario cannot be built."""


class PackingError(ConcordemError, ValueError):
    """A packing cannot be made or read."""


class OperatorError(ConcordemError, ValueError):
    """An operator refuses its input."""


class SolverError(ConcordemError, RuntimeError):
    """The calculation cannot go on."""


class StaticsError(ConcordemError, RuntimeError):
    """A static problem has no answer."""


class CalibrationError(ConcordemError, RuntimeError):
    """There are no parameters for what is wanted."""


class ResultError(ConcordemError, RuntimeError):
    """A result or checkpoint cannot be read or written."""


class InternalError(ConcordemError, RuntimeError):
    """A fault of the program itself. The simulation it happened in cannot be used further; please report it."""


class YadeError(ConcordemError, RuntimeError):
    """The bridge to YADE refuses to work with this YADE, this scene, or this state of it."""
