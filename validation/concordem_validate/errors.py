"""What can go wrong with an engine, each kind with its own place in the verdict."""


class HarnessError(Exception):
    """A case, a file, or an argument is not as it must be."""


class Unsupported(HarnessError):
    """A scenario says something that an engine's translation does not carry over. Never passed over in silence."""


class NotInstalled(HarnessError):
    """The peer is not on this machine; the message says how to get it."""


class TimedOut(HarnessError):
    """The engine did not end in the time the case allows; its processes have been stopped."""


class Crashed(HarnessError):
    """The engine ended with an error; the message ends with the last lines it wrote."""
