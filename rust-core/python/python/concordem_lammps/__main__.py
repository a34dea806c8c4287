"""``python -m concordem_lammps``: print the folder of the plugin for LAMMPS."""

import sys

from . import plugin_folder, problem


def main() -> int:
    """Print the folder, or why there is none; return the exit code."""
    if len(sys.argv) > 1:
        print(f"concordem_lammps takes no arguments, but got {' '.join(sys.argv[1:])}; remove them", file=sys.stderr)
        return 2
    reason = problem()
    if reason is not None:
        print(f"concordem: {reason}", file=sys.stderr)
        return 1
    print(plugin_folder())
    return 0


if __name__ == "__main__":
    sys.exit(main())
