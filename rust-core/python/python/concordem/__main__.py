"""The command-line program: ``concordem --help``, or ``python -m concordem --help``; ``posterior`` is a command of this package alone."""

import signal
import sys

from . import _core
from ._errors import InternalError


def main() -> int:
    """Run the program with the arguments of this process; return its exit code."""
    if sys.argv[1:2] == ["posterior"]:
        # In Python, because the emulator and the sampler are.
        from .inference._command import main as posterior

        return posterior(sys.argv[2:])
    # Ctrl-C belongs to the program: it writes a checkpoint, or ends at once. Python's own handler would print a traceback after that.
    # A shell that starts the program in the background ignores Ctrl-C for it; that stays.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        return _core.run_program(sys.argv[1:], _core.__file__)
    except InternalError as error:
        print(
            f"concordem {_core.__version__}: internal error: {error}\n"
            "Please report it with the command, the scenario, and these lines.",
            file=sys.stderr,
        )
        return 1


if __name__ == "__main__":
    sys.exit(main())
