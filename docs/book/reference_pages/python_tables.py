"""The module `concordem.tables`: every table of a scenario as a typed dictionary, from `concordem schema`."""

import keyword
import textwrap

from .schema import bounds
from .text import ROOT

MODULE = ROOT / "rust-core/python/python/concordem/tables.py"
HEAD = '''"""The tables of a scenario as typed dictionaries: editors complete their keys and find mistakes in them before a run.

>>> from concordem import Scenario, tables
>>> glass = tables.Material(name="glass", density="2500 kg/m^3", hertz_mindlin=tables.HertzMindlin(young="1 GPa", poisson=0.2))
>>> scenario = Scenario(
...     packing=tables.PackingSpheres(kind="spheres", spheres=[[0, 0, 0, "1 mm"]]),
...     material=glass, contacts={"law": "hertz_mindlin"}, stop={"steps": 1})
>>> Scenario.from_text(scenario.text).to_dict() == scenario.to_dict()
True

At run time they are dictionaries: `Scenario` checks keys and values. Written by docs/book/generate_reference.py --write from the schema that
the program reads scenarios by; changes are lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import Any, Literal, Required, TypeAlias, TypedDict

import numpy as np
from numpy.typing import NDArray

#: A number in SI units, or a text with a unit: `30e9` or `"30 GPa"`.
Quantity: TypeAlias = float | str | np.number[Any]
_Path: TypeAlias = str | PathLike[str]
'''
#: Names of the classes that editors show beside those of the schema.
ROOT_NAME = "ScenarioTables"


def quoted(text):
    """A literal of Python."""
    return f"'{text}'" if '"' in text else f'"{text}"'


def literal(values):
    return f"Literal[{', '.join(quoted(one) if isinstance(one, str) else repr(one) for one in values)}]"


def camel(word):
    return "".join(part.capitalize() for part in word.replace("_", "-").split("-"))


class Module:
    """The text of the module: one class for each table, one for each kind of a table, a choice of words for each list of words."""

    def __init__(self, schema):
        self.schema = schema
        self.classes = []

    def type_of(self, schema, name):
        """The type of a value; `name`: that of a class, if one is needed for it."""
        if "$ref" in schema:
            return schema["$ref"].rsplit("/", 1)[1]
        if "anyOf" in schema:
            return self.any_of([self.type_of(one, name) for one in schema["anyOf"]])
        if "oneOf" in schema:
            return self.choice(schema, name)
        if "const" in schema or "enum" in schema:
            values = schema.get("enum", [schema.get("const")])
            return literal(values)
        if "properties" in schema:
            return self.table(schema, name)
        kinds = schema.get("type", [])
        kinds = [kinds] if isinstance(kinds, str) else kinds
        if not kinds:
            raise SystemExit(f"tables.py: {name} has no type in the schema")
        found = ["Quantity"] if "number" in kinds and "string" in kinds else []
        for kind in kinds:
            match kind:
                case "number" | "string" if found == ["Quantity"]:
                    continue
                case "array":
                    found.append(self.array(schema, name))
                case "string":
                    found.append("_Path" if name.endswith(("Path", "File")) else "str")
                case _:
                    found.append({"number": "float | np.number[Any]", "integer": "int | np.integer[Any]", "boolean": "bool", "null": "None"}[kind])
        return self.any_of(found)

    @staticmethod
    def any_of(types):
        """None last."""
        return " | ".join(sorted(dict.fromkeys(types), key=lambda one: one == "None"))

    def array(self, schema, name):
        if "prefixItems" in schema:
            parts = self.any_of([self.type_of(one, f"{name}Item") for one in schema["prefixItems"]])
        else:
            parts = self.type_of(schema["items"], f"{name}Item")
        tables = "x-dimension" not in schema.get("items", {}) and ("$ref" in schema.get("items", {}) or "properties" in schema.get("items", {}))
        return f"Sequence[{parts}]" if tables else f"Sequence[{parts}] | NDArray[Any]"

    def choice(self, schema, name):
        """A choice of words, or of tables by their kind."""
        words = [one["const"] for one in schema["oneOf"] if "const" in one] + [w for one in schema["oneOf"] for w in one.get("enum", [])]
        others = [one for one in schema["oneOf"] if "const" not in one and "enum" not in one]
        types = [literal(words)] if words else []
        for one in others:
            kind = one.get("properties", {}).get("kind", {}).get("const")
            types.append(self.table(one, f"{name}{camel(kind)}") if kind else self.type_of(one, f"{name}Item"))
        return self.any_of(types)

    def table(self, schema, name):
        """Write a class, and give its name."""
        # Python gives the version of the format itself
        required = set(schema.get("required", [])) - ({"version"} if name == ROOT_NAME else set())
        fields = {}
        for key, one in schema["properties"].items():
            kind = self.type_of(one, name + camel(key))
            if name == ROOT_NAME and one.get("type") == "array" and kind.startswith("Sequence["):
                # a single table may stand for a list of one
                kind = f"{kind[len('Sequence['):-1]} | {kind}"
            fields[key] = f"Required[{kind}]" if key in required else kind
        if any(keyword.iskeyword(key) for key in fields):
            # such a name can only be the key of a dictionary
            about = [f"#: {line}" for line in self.lines(schema, 3)]
            rows = [f"        {quoted(key)}: {quoted(kind)}," for key, kind in fields.items()]
            self.classes.append("\n".join([*about, f"{name} = TypedDict(", f"    {quoted(name)},", "    {", *rows, "    },", "    total=False,", ")"]))
            return name
        lines = [f"class {name}(TypedDict, total=False):", *self.text(schema), ""]
        for key, kind in fields.items():
            lines += [f"    {key}: {kind}", *self.text(schema["properties"][key])]
        self.classes.append("\n".join(lines).rstrip())
        return name

    @staticmethod
    def lines(schema, indent):
        """The description, with the range of a number, in lines."""
        said = " ".join(schema.get("description", "").split()).replace("[module documentation](super)", "book").replace("\\", "\\\\")
        limit = bounds(schema)
        said += f" Range: {limit}." if limit else ""
        return textwrap.wrap(said, 150 - indent, break_long_words=False, break_on_hyphens=False)

    def text(self, schema):
        """The description as a docstring."""
        lines = self.lines(schema, 10)
        if not lines:
            return []
        # a quote at the end would close the text
        end = ' """' if lines[-1].endswith('"') else '"""'
        return ["    " + ('"""' if k == 0 else "") + line + (end if k == len(lines) - 1 else "") for k, line in enumerate(lines)]

    def __str__(self):
        aliases = []
        for name, one in sorted(self.schema["$defs"].items()):
            kind = self.type_of(one, name)
            if kind != name:
                aliases.append("\n".join([*(f"#: {line}" for line in self.lines(one, 3)), f"{name}: TypeAlias = {kind}"]))
        self.table(self.schema, ROOT_NAME)
        return "\n\n\n".join([HEAD, *self.classes, "\n".join(aliases)]).replace("\n\n\n\n", "\n\n\n") + "\n"


def committed(schema, write):
    """Write the module, or refuse one that is not up to date."""
    text = str(Module(schema))
    if not MODULE.exists() or MODULE.read_text(encoding="utf-8") != text:
        if not write:
            raise SystemExit(f"{MODULE.relative_to(ROOT)} is not up to date; run docs/book/generate_reference.py --write")
        MODULE.write_text(text, encoding="utf-8")
