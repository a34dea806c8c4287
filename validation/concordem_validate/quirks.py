"""Registry of quirks: documented differences between codes and equations, their size, and the cases that check them."""
import tomllib
from pathlib import Path

from .errors import HarnessError

PATH = Path(__file__).parents[1] / "quirks.toml"
_KEYS = {"engine", "title", "what", "source", "effect", "aligned", "cases"}


def load(path=PATH):
    with open(path, "rb") as file:
        quirks = tomllib.load(file)
    for name, quirk in quirks.items():
        missing = _KEYS - quirk.keys()
        if missing:
            raise HarnessError(f"{path.name}: quirk `{name}` lacks {', '.join(sorted(missing))}; add them")
    return quirks
