"""Tests of the harness. Tests that need the program or a peer are skipped if it is missing, or fail if CI is set."""
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from concordem_validate import runner  # noqa: E402
from concordem_validate.engines import ENGINES, concordem  # noqa: E402
from concordem_validate.errors import NotInstalled  # noqa: E402


def need(*engines):
    """Skip or fail unless these engines exist; `operators` is our Python package."""
    for name in engines:
        try:
            concordem.package() if name == "operators" else ENGINES[name].version()
        except NotInstalled as error:
            if runner.strict_by_default():
                pytest.fail(str(error))
            pytest.skip(str(error))
