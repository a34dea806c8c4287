"""Packages that only this part needs."""

from __future__ import annotations

import importlib
from typing import Any

_PACKAGES = {"sklearn": "scikit-learn"}


def needed(module: str) -> Any:
    """An optional module, or an error that says how to install it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = _PACKAGES.get(module, module)
        raise ImportError(f"{package} is missing; install it with: python -m pip install 'concordem[inference]'") from error
