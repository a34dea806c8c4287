"""Errors of the harness; each class has its own status in the verdict."""


class HarnessError(Exception):
    """An invalid case, file, or argument."""


class Unsupported(HarnessError):
    """A scenario contains something that the translation to an engine does not support. It is never ignored silently."""


class Refused(Unsupported):
    """An engine of the user says itself that it cannot compute a scenario. It is skipped by name."""


class NotInstalled(HarnessError):
    """The peer is not installed; the message gives the command to install it."""


class TimedOut(HarnessError):
    """The engine exceeded the time limit of the case; its processes have been stopped."""


class Crashed(HarnessError):
    """The engine failed; the message ends with the last lines of its output."""


class Incomparable(HarnessError):
    """Results that no number can compare: too short, not a number, without the series. The cause is a word for reports."""

    def __init__(self, cause, message):
        super().__init__(message)
        self.cause = cause
