"""The command-line program: ``python -m concordem --help``."""

import sys

from ._core import run_program


def main() -> int:
    """Run the program with the arguments of this process; return its exit code."""
    return run_program(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
