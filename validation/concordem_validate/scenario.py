"""Reads scenario files, applies the changes of a variant, and writes them."""
import copy
import difflib
import json
import math
import re

from . import tables
from .errors import HarnessError
from .quantity import si

_QUANTITY, _SWITCH = (float, str), bool
# What the harness reads itself: a misspelled key here would be ignored where ConcorDEM, which checks all tables, does not run. Other codes
# may have tables of their own.
_TABLES = {
    "output": {"file": str, "sample_interval": int, "snapshot_interval": int, "bond_snapshots": _SWITCH, "checkpoint_interval": int,
               "events_damage": float, "csv": _SWITCH},
    "stop": {"drop_to": float, "strain": float, "time": _QUANTITY, "steps": int, "unbalanced": float},
    "integration": {"scheme": str, "time_step": _QUANTITY, "safety": _QUANTITY, "contact_safety": float, "allow_energy_error": _SWITCH,
                    "allow_unstable": _SWITCH, "damping": dict, "gravity": list},
    "contacts": {"law": str, "exclude": list},
    "bonds": {"law": str, "interaction_ratio": _QUANTITY, "coordination": float, "at_start": _SWITCH, "strength_factors": list,
              "face_correction": _SWITCH},
}
# The dimension of a quantity, which a text with a unit must have.
_OF = {"time": "s", "time_step": "s", "density": "kg/m^3"}
_ROWS = {"material", "set", "initial", "prescribe", "force", "wall", "sample", "stage", "interface", "history", "cut"}

_NAMES = {*_TABLES, *_ROWS, "version", "title", "author", "packing", "loading", "kinematics", "dimension", "heat", "deformable"}


def load(path):
    """The scenario of a file. Mistakes in what the harness reads itself are told with their line."""
    file = tables.File(path)
    for name, table in file.data.items():
        meant = difflib.get_close_matches(name, _NAMES, 1, 0.8) if name not in _NAMES else []
        if meant:
            raise file.error(name, f"unknown key {name}; did you mean {meant[0]}?", table=name)
        if name in _TABLES:
            if not isinstance(table, dict):
                raise file.error(name, f"`{name}` is {table!r}; write [{name}]")
            file.check(table, _TABLES[name], name)
            _numbers(file, name, table)
        elif name in _ROWS and not (isinstance(table, list) and all(isinstance(row, dict) for row in table)):
            raise file.error(name, f"`{name}` is no list of tables; write [[{name}]]")
    if file.data.get("version", 1) != 1:
        raise file.error("version", f"`version` is {file.data['version']!r}; this harness reads 1")
    count = _spheres(file)
    _sets(file, count)
    for number, row in enumerate(file.data.get("material", [])):
        for key in ("name", "density"):
            if key not in row:
                raise file.error(key, f"a material has no `{key}`; add it", number, "material")
        if not isinstance(row["name"], str):
            raise file.error("name", f"`name` is {row['name']!r}; give text", number, "material")
        _quantity(file, "density", row["density"], number, "material")
    return file.data


def _numbers(file, name, table):
    """Counts from 1, and quantities."""
    for key, value in table.items():
        kind = _TABLES[name][key]
        if kind is int and value < 1:
            raise file.error(key, f"`{key}` is {value}; give a whole number from 1", table=name)
        if kind is _QUANTITY and value != "auto":
            _quantity(file, key, value, table=name)
            if key in ("time", "time_step") and not si(value) > 0:
                raise file.error(key, f"`{key}` is {value}; give a time above zero", table=name)


def _quantity(file, key, value, number=None, table=None):
    try:
        size = si(value, _OF.get(key))
    except HarnessError as error:
        raise file.error(key, f"`{key}`: {error}", number, table) from None
    if not math.isfinite(size):
        raise file.error(key, f"`{key}` is {value}; give a finite number", number, table)
    return size


def _spheres(file):
    """How many spheres the scenario gives itself, if it does."""
    packing = file.data.get("packing", {})
    if not isinstance(packing, dict) or "packing" in file.data and not isinstance(packing.get("kind"), str):
        raise file.error("kind", "the packing has no `kind`; give one, such as kind = \"spheres\"", table="packing")
    if packing.get("kind") != "spheres":
        return None
    rows = packing.get("spheres")
    if not isinstance(rows, list) or any(not isinstance(row, list) or len(row) != 4 for row in rows):
        raise file.error("spheres", "`spheres` must be a list of [x, y, z, radius]", table="packing")
    for row in rows:
        sizes = [_quantity(file, "spheres", value, table="packing") for value in row]
        if not sizes[3] > 0:
            raise file.error("spheres", f"`spheres` has the radius {row[3]}; give one above zero", table="packing")
    return len(rows)


def _sets(file, count):
    """Sets that do not exist, and ids of particles that do not."""
    names = set()
    for number, row in enumerate(file.data.get("set", [])):
        names.add(row.get("name"))
        selection = row.get("selection", {})
        ids = selection.get("ids", []) if isinstance(selection, dict) and selection.get("kind") == "ids" else []
        wrong = [i for i in ids if type(i) is not int or not 0 <= i < (count or math.inf)] if isinstance(ids, list) else [ids]
        if wrong:
            raise file.error("selection", f"the set `{row.get('name')}` has the id {wrong[0]!r}; "
                                          + (f"give ids from 0 to {count - 1}" if count else "give whole numbers from 0"), number, "set")
    for table in ("initial", "prescribe", "force"):
        for number, row in enumerate(file.data.get(table, [])):
            if isinstance(row.get("set"), str) and row["set"] not in names:
                raise file.error("set", f"there is no set `{row['set']}`; the sets are {', '.join(sorted(map(str, names))) or 'none'}", number, table)


def line_of(place, message):
    """` (FILE:LINE)` of the only key of a scenario that a message names; what an engine does not know may be misspelled."""
    try:
        lines = place.read_text().splitlines()
    except (OSError, UnicodeDecodeError):
        return ""
    words = set(re.findall(r"[a-z][a-z_]{3,}", message))
    found = {k for k, text in enumerate(lines, 1) for key in re.findall(r"([A-Za-z_][\w-]*)\s*=", text.partition("#")[0]) if key in words}
    return f" ({place}:{found.pop()})" if len(found) == 1 else ""


def changed(document, changes):
    """A copy with the values at dotted paths such as `material.0.cpm.damage_law` replaced. An index one past the end appends to a list;
    `None` (in a case file the string `__remove__`) removes a key."""
    document = copy.deepcopy(document)
    for path, value in changes.items():
        place = document
        *front, last = [int(key) if key.isdigit() else key for key in path.split(".")]
        for key in front:
            if isinstance(place, dict) and isinstance(key, str):
                place = place.setdefault(key, {})
            elif isinstance(key, int) and isinstance(place, list) and key < len(place):
                place = place[key]
            elif isinstance(key, int) and isinstance(place, list) and key == len(place):
                place.append({})
                place = place[key]
            else:
                raise HarnessError(f"the scenario has no key `{path}`; check the path")
        if not isinstance(place, dict if isinstance(last, str) else list) or isinstance(place, list) and last > len(place):
            raise HarnessError(f"the scenario has no key `{path}`; check the path")
        if value is None or value == "__remove__":
            place.pop(*([last, None] if isinstance(place, dict) else [last]))
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
