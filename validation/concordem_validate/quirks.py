"""Registry of quirks: documented differences between codes and equations, their size, and the cases that check them.

A folder of cases may have its own `quirks.toml`; ours are known everywhere. `until`, `owner`, and `link` are optional: a known difference
that is past its day fails.
"""
import datetime
from functools import cache
from pathlib import Path

from . import tables
from .errors import HarnessError

PATH = next((p for p in (Path(__file__).parent / "cases" / "quirks.toml", Path(__file__).parents[1] / "cases" / "quirks.toml") if p.exists()), None)
_KEYS = {"engine": str, "title": str, "what": str, "source": str, "effect": str, "aligned": str, "cases": list}
_OPTIONAL = {"owner": str, "link": str, "until": datetime.date}


def load(path=None):
    path = Path(path or PATH)
    about = path.stat()
    return _load(path, about.st_mtime_ns)


def load_all(root):
    """Our quirks and those of a folder of cases."""
    own = Path(root) / "quirks.toml"
    return {**(load() if PATH else {}), **(load(own) if own.exists() else {})}


@cache
def _load(path, modified):
    file = tables.File(path)
    for name, quirk in file.data.items():
        if not isinstance(quirk, dict):
            raise HarnessError(f"{path}: `{name}` is no table of a quirk; write [{name}]")
        file.check(quirk, {**_KEYS, **_OPTIONAL}, name)
        missing = {key for key in _KEYS if key != "cases" and not quirk.get(key) or key not in quirk}
        if missing:
            raise HarnessError(f"{path}:{file.line('', table=name)}: quirk `{name}` lacks {', '.join(sorted(missing))}; add them")
    return file.data
