"""Reads scenario files, applies the changes of a variant, and writes them."""
import copy
import json

from . import tables
from .errors import HarnessError


def load(path):
    return tables.File(path).data


def changed(document, changes):
    """A copy with the values at dotted paths such as `material.0.cpm.damage_law` replaced. An index one past the end appends to a list;
    `None` (in a case file the string `__remove__`) removes a key."""
    document = copy.deepcopy(document)
    for path, value in changes.items():
        place = document
        *front, last = [int(key) if key.isdigit() else key for key in path.split(".")]
        for key in front:
            if isinstance(place, dict):
                place = place.setdefault(key, {})
            elif isinstance(key, int) and key < len(place):
                place = place[key]
            elif isinstance(key, int) and key == len(place):
                place.append({})
                place = place[key]
            else:
                raise HarnessError(f"the scenario has no key `{path}`; check the path")
        if value is None or value == "__remove__":
            place.pop(last, None)
        elif isinstance(place, list) and last == len(place):
            place.append(value)
        else:
            place[last] = value
    return document


def _inline(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, list):
        return "[" + ", ".join(_inline(item) for item in value) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_inline(item)}" for key, item in value.items()) + " }"
    raise HarnessError(f"cannot write {value!r} to a scenario; use a number, string, boolean, list, or table")


def dumps(document):
    """TOML text. Top-level tables have headers, deeper ones are inline."""
    lines = [f"{key} = {_inline(value)}" for key, value in document.items() if not _is_table(value)]
    for key, value in document.items():
        if isinstance(value, dict):
            lines += ["", f"[{key}]"] + [f"{k} = {_inline(v)}" for k, v in value.items()]
        elif _is_table(value):
            for item in value:
                lines += ["", f"[[{key}]]"] + [f"{k} = {_inline(v)}" for k, v in item.items()]
    return "\n".join(lines) + "\n"


def _is_table(value):
    return isinstance(value, dict) or isinstance(value, list) and bool(value) and isinstance(value[0], dict)
