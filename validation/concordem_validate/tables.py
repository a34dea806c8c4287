"""TOML files whose mistakes are told with file, line, and key."""
import datetime
import math
import re
import tomllib
from pathlib import Path

from .errors import HarnessError

_WORDS = {datetime.date: "a day such as 2027-06-01", str: "text", float: "a number", int: "a whole number", list: "a list",
          dict: "a table", bool: "true or false"}


class File:
    """A TOML file and the places of its keys."""

    def __init__(self, path):
        self.path = Path(path)
        try:
            self.text = self.path.read_text()
            self.data = tomllib.loads(self.text)
        except FileNotFoundError:
            raise HarnessError(f"{path} does not exist; add it, or mend the path") from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError) as error:
            raise HarnessError(f"{path}: {error}; mend the TOML") from None

    def line(self, key, number=None, table=None):
        """Line of a key: at the top, or in the table `[[table]]` of this number, or `[table]`."""
        lines = self.text.splitlines()
        start, end = 0, len(lines)
        if table:
            headers = [k for k, text in enumerate(lines) if re.match(rf"\s*\[\[?\s*{re.escape(table)}\s*\]\]?", text)]
            if (number or 0) < len(headers):
                start = headers[number or 0]
                end = next((k for k in range(start + 1, len(lines)) if re.match(r"\s*\[", lines[k])), len(lines))
        found = next((k for k in range(start, end) if re.match(rf"\s*\"?{re.escape(key)}\"?\s*=", lines[k])), None)
        return (start if found is None else found) + 1

    def error(self, key, message, number=None, table=None):
        return HarnessError(f"{self.path}:{self.line(key, number, table)}: {message}")

    def check(self, table, allowed, name=None, number=None):
        """Refuse unknown keys and values of another type."""
        for key, value in table.items():
            if key not in allowed:
                raise self.error(key, f"unknown key {key}; valid keys are {', '.join(sorted(allowed))}", number, name)
            kinds = allowed[key] if isinstance(allowed[key], tuple) else (allowed[key],)
            fits = any(isinstance(value, (int, float) if kind is float else kind) and (kind is bool or not isinstance(value, bool))
                       for kind in kinds)
            if not fits:
                raise self.error(key, f"`{key}` is {value!r}; give {' or '.join(_WORDS[k] for k in kinds)}", number, name)
            if any(isinstance(v, float) and not math.isfinite(v) for v in (value if isinstance(value, list) else [value])):
                raise self.error(key, f"`{key}` is {value}; give a finite number", number, name)

    def rows(self, key, kind, values, number=None, name=None):
        """Refuse a list with something else than texts or tables."""
        wrong = [v for v in values if not isinstance(v, kind)]
        if wrong:
            raise self.error(key, f"`{key}` has {wrong[0]!r}; give {_WORDS[kind]}", number, name)
        return values

    def file_name(self, key, value, number=None, name=None):
        """Refuse a name that cannot be part of the name of a file."""
        if not re.fullmatch(r"[^/\\\x00-\x1f\x7f]{1,100}", value) or value.startswith("."):
            raise self.error(key, f"the name {value!r} is part of names of files; give up to 100 characters without a slash, and no dot in front", number, name)
