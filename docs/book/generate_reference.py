#!/usr/bin/env python3
"""Write the generated part of the book's reference into docs/book/reference/generated (not committed).

* scenario-TABLE.md: every key, from `concordem schema`; examples are the values in templates and tests/scenarios/good
* commands.md: `concordem COMMAND --help`
* results.md: datasets of small runs' result files, with their units and descriptions
* python.md: the package, from its stub, its docstrings, and the doc comments of its Rust functions; nothing is imported
"""

import argparse
import ast
import json
import re
import subprocess
import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

BOOK = Path(__file__).resolve().parent
ROOT = BOOK.parents[1]
TARGET = BOOK / "reference/generated"
PACKAGE = ROOT / "yade-bridge/python/concordem"
NOTE = "<!-- Written by generate_reference.py; changes are lost. -->\n"

# The order of pages, and the titles of those whose key says too little.
TABLES = {
    "top": "Top level",
    "packing": "packing",
    "material": "material",
    "interface": "interface",
    "bonds": "bonds",
    "cut": "cut",
    "contacts": "contacts",
    "deformable": "deformable",
    "wall": "wall",
    "set": "set",
    "clump": "clump",
    "prescribe": "prescribe",
    "force": "force",
    "initial": "initial",
    "integration": "integration",
    "loading": "loading",
    "stage": "stage",
    "history": "history",
    "sample": "sample",
    "stop": "stop",
    "output": "output",
}


# Examples of keys that no template and no scenario in tests/scenarios/good has; run_code_blocks.py does not see them.
OWN_EXAMPLES = {
    ("Deformable", None, "dashpots"): True,
    ("Deformable", None, "maximum_iterations"): 100,
    ("Deformable", None, "relaxation"): 0.8,
    ("Deformable", None, "tolerance"): 1e-8,
    ("Initial", None, "angular_velocity"): [0, 0, "10 rad/s"],
    ("Damping", "local", "rotation"): 0.1,
    ("Damping", "tchamwa-wielgosz", "form"): "position-term",
    ("Loading", "bending", "initial_velocity_field"): False,
    ("Loading", "bending", "layer_thickness"): "4 mm",
    ("Loading", "torsion", "initial_velocity_field"): False,
    ("Loading", "torsion", "layer_thickness"): "4 mm",
    ("Loading", "cell-stress", "tolerance"): 0.01,
    ("CohesiveBeam", None, "hydrostatic_strength"): "64 MPa",
    ("CohesiveBeam", None, "model"): "timoshenko",
    ("CohesiveBeam", None, "radius"): "0.7 mm",
    ("CohesiveBeam", None, "shear_coefficient"): 0.9,
    ("CohesiveBeam", None, "shear_ratio"): 0.3,
    ("Output", None, "events_damage"): 0.5,
    ("Packing", "random-discs", "radius"): "0.1 mm",
    ("Packing", "random-discs", "solid_fraction"): 0.9,
    ("Packing", "lattice", "shape"): {"kind": "cylinder", "radius": "10 mm", "height": "20 mm"},
    ("Radii", "table", "radii"): ["1 mm", "1.5 mm"],
    ("Radii", "table", "shares"): [0.7, 0.3],
    ("Shape", "mesh", "path"): "specimen.stl",
    ("Shape", "mesh", "unit"): "1 mm",
}

# --- scenario ----------------------------------------------------------------------------------------------------


def toml(value):
    """A value as TOML in one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(toml(one) for one in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, float) and value == int(value) and abs(value) < 1e6:
        return str(int(value))
    return str(value)


class Schema:
    """The JSON Schema of scenarios."""

    def __init__(self, root):
        self.root = root

    def resolve(self, schema):
        """Behind references, and behind a choice with null."""
        while True:
            if "$ref" in schema:
                schema = self.root["$defs"][schema["$ref"].rsplit("/", 1)[1]]
            elif "anyOf" in schema:
                schema = next(one for one in schema["anyOf"] if one.get("type") != "null")
            else:
                return schema

    def words(self, schema):
        """Allowed words with their meaning, if the schema is a choice of words."""
        if all(isinstance(one, str) for one in schema.get("enum", [0])):
            return [(word, "") for word in schema["enum"]]
        found = []
        for one in schema.get("oneOf", []):
            if "const" in one:
                found.append((one["const"], one.get("description", "")))
            elif "enum" in one:
                found += [(word, "") for word in one["enum"]]
            else:
                return []
        return found

    def kinds(self, schema):
        """Variants of a table by their `kind`."""
        return {
            one["properties"]["kind"]["const"]: one
            for one in schema.get("oneOf", [])
            if "const" in one.get("properties", {}).get("kind", {})
        }

    def is_table(self, schema):
        return "properties" in schema or bool(self.kinds(schema))

    def items(self, schema):
        return self.resolve(schema["items"]) if isinstance(schema.get("items"), dict) else {}

    def variant(self, schema, value):
        kinds = self.kinds(schema)
        return kinds.get(value.get("kind"), {}) if kinds else schema


def examples(schema, documents):
    """Values of keys by (title of the table's schema, key): the first that a document has."""
    found = {}

    def walk(table_schema, name, table):
        table_schema = schema.resolve(table_schema)
        variant = schema.variant(table_schema, table)
        kind = table.get("kind") if schema.kinds(table_schema) else None
        for key, value in table.items():
            inner = variant.get("properties", {}).get(key)
            if inner is None:
                continue
            found.setdefault((name, kind, key), value)
            inner_name = definition(inner) or f"{name}.{key}"
            inner = schema.resolve(inner)
            if isinstance(value, dict):
                walk(inner, inner_name, value)
            elif isinstance(value, list):
                for one in value:
                    if isinstance(one, dict):
                        walk(inner["items"], definition(inner["items"]) or inner_name, one)

    for document in documents:
        walk(schema.root, "Scenario", document)
    return found


def definition(schema):
    """Name of the definition a schema refers to."""
    for one in [schema, *schema.get("anyOf", [])]:
        if "$ref" in one:
            return one["$ref"].rsplit("/", 1)[1]
    return None


def bounds(schema):
    signs = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
    return ", ".join(f"{sign} {schema[key]:,}" for key, sign in signs.items() if key in schema)


def type_of(schema, root):
    """What a value is, in words, and its units."""
    inner = root.resolve(schema)
    both = {**inner, **{key: value for key, value in schema.items() if key != "description"}}
    if "x-dimension" in both:
        units = [unit for unit in both["x-units"] if unit != "1"]
        text = both["x-dimension"]
        if text == "pure number":
            text, units = "number", []
        if units:
            text += f" in {units[0]}" + (f" (also {', '.join(units[1:])})" if units[1:] else "")
        text += "".join(f' or `"{word}"`' for word in both.get("x-words", []))
    elif root.words(inner):
        text = "word"
    elif root.is_table(inner):
        text = "table"
    elif inner.get("type") == "array" or "array" in inner.get("type", []):
        if "prefixItems" in inner:
            return f"[{', '.join(type_of(item, root) for item in inner['prefixItems'])}]"
        items, low, high = inner["items"], inner.get("minItems"), inner.get("maxItems")
        count = f"{low} × " if low == high and low else ""
        text = f"list: {count}{type_of(items, root)}"
    else:
        kind = inner.get("type", "value")
        kind = next(one for one in kind if one != "null") if isinstance(kind, list) else kind
        text = {"boolean": "true or false", "integer": "integer", "string": "string", "number": "number"}.get(kind, kind)
        if "enum" in both:
            text += ": " + ", ".join(map(str, both["enum"]))
    limit = bounds(both)
    return text + (f", {limit}" if limit else "")


def sentence(text):
    text = " ".join(text.split())
    # Angle brackets and dollars are markup to the book.
    return text.replace("<", "&lt;").replace("$", "\\$")


class ScenarioPages:
    def __init__(self, schema, found):
        self.schema, self.found = schema, found
        doubled = set(found) & set(OWN_EXAMPLES)
        assert not doubled, f"these have an example already: {doubled}"

    def key(self, name, schema, required, example):
        """One key as an entry of a definition list."""
        inner = self.schema.resolve(schema)
        facts = [type_of(schema, self.schema)]
        if required:
            facts.append("**required**")
        elif schema.get("default") not in (None, "", []):
            facts.append(f"default `{toml(schema['default'])}`")
        lines = [f"`{name}`", f": {sentence(schema.get('description') or inner.get('description', ''))}", ""]
        lines += [f"  *{facts[0][0].upper()}{facts[0][1:]}*" + "".join(f" · {fact}" for fact in facts[1:]), ""]
        words = self.schema.words(inner)
        if words:
            lines += [f'  - `"{word}"`' + (f": {sentence(meaning)}" if meaning else "") for word, meaning in words] + [""]
        if example is not None:
            text = toml(example)
            if len(text) <= 110:
                lines += [f"  Example: `{name} = {text}`", ""]
            elif isinstance(example, dict):
                lines += [f"  Example: `{name} = {{ {next(f'{key} = {toml(one)}' for key, one in example.items())}, … }}`", ""]
        return lines

    def keys(self, name, kind, schema):
        lines = []
        for key, inner in schema.get("properties", {}).items():
            if key == "kind" and "const" in inner:
                continue
            example = self.found.get((name, kind, key), OWN_EXAMPLES.get((name, kind, key)))
            lines += self.key(key, inner, key in schema.get("required", []), example)
        return lines

    def table(self, path, schema, level, name):
        """A table and the tables in it."""
        schema = self.schema.resolve(schema)
        lines, inner = [], []
        kinds = self.schema.kinds(schema)
        if kinds:
            lines += ["`kind` selects one of these:", ""]
            for kind, variant in kinds.items():
                lines += [f"{'#' * level} `{path}`, kind `{kind}`", "", sentence(variant.get("description", "")), ""]
                keys = self.keys(name, kind, variant)
                lines += keys or ["No further keys.", ""]
            variants = list(kinds.values())
        else:
            lines += self.keys(name, None, schema)
            variants = [schema]
        for variant in variants:
            for key, value in variant.get("properties", {}).items():
                resolved = self.schema.resolve(value)
                items = self.schema.items(resolved)
                if self.schema.is_table(items):
                    value, resolved = resolved["items"], items
                title = definition(value) or f"{name}.{key}"
                if self.schema.is_table(resolved) and title not in [one[1] for one in inner]:
                    inner.append((f"{path}.{key}", title, resolved))
        for inner_path, title, resolved in inner:
            lines += [f"{'#' * level} `{inner_path}`", "", sentence(resolved.get("description", "")), ""]
            lines += self.table(inner_path, resolved, level + 1, title)
        return lines

    def page(self, key):
        root = self.schema.root
        if key == "top":
            lines = ["# Top level", "", sentence(root.get("description", "")), ""]
            plain = {name: one for name, one in root["properties"].items() if name not in TABLES}
            for name, one in plain.items():
                lines += self.key(name, one, name in root["required"], self.found.get(("Scenario", None, name)))
            return "\n".join(lines)
        schema = root["properties"][key]
        resolved = self.schema.resolve(schema)
        items = self.schema.items(resolved)
        many = self.schema.is_table(items)
        name = definition(resolved["items"] if many else schema) or key
        heading = f"[[{key}]]" if many else f"[{key}]"
        lines = [f"# `{heading}`", "", sentence(schema.get("description", "")), ""]
        described = (items if many else resolved).get("description", "")
        if len(described) > 30 and described != schema.get("description"):
            lines += [sentence(described), ""]
        if many:
            lines += ["May occur several times." + (" At least one is required." if key in root["required"] else ""), ""]
        else:
            lines += ["Required.", ""] if key in root["required"] else ["Optional.", ""]
        table = items if many else resolved
        if key == "interface":
            # Its laws have the keys of a material's.
            table = {**table, "properties": {k: v for k, v in table["properties"].items() if k == "between"}}
            laws = [f"`{name}`" for name in items["properties"] if name != "between"]
            lines += [f"The parameter tables {', '.join(laws[:-1])}, and {laws[-1]} have the keys",
                      "of [a material's](scenario-material.md).", ""]
        return "\n".join(lines + self.table(key, table, 2, name))


def scenario(program, run):
    schema = Schema(json.loads(run(program, "schema")))
    documents = []
    with tempfile.TemporaryDirectory() as folder:
        for name in templates(program, run):
            run(program, "init", "--template", name, folder)
        for path in [*sorted(Path(folder).glob("*.toml")), *sorted((ROOT / "tests/scenarios/good").glob("*.toml"))]:
            document = tomllib.loads(path.read_text(encoding="utf-8-sig"))
            if "packing" in document:
                documents.append(document)
    pages = ScenarioPages(schema, examples(schema, documents))
    unknown = set(schema.root["properties"]) - set(TABLES) - {"version", "title", "dimension", "kinematics"}
    assert not unknown, f"new tables of scenarios: {unknown}"
    return {f"scenario-{key}.md": pages.page(key) for key in TABLES}


def templates(program, run):
    return re.findall(r"^  (\S+)  ", run(program, "init"), re.M)


# --- commands ----------------------------------------------------------------------------------------------------


def commands(program, run):
    def names(text):
        block = text.split("Commands:\n")[1].split("\n\n")[0]
        return [name for name in re.findall(r"^  (\w+)", block, re.M) if name != "help"]

    top = run(program, "--help")
    lines = ["# Commands", "", "The output of `concordem --help` and of every command's `--help`.", "", "## concordem", "", "```text", top.rstrip(), "```", ""]
    calls = []
    for name in names(top):
        calls.append([name])
        text = run(program, name, "--help")
        if "Commands:\n" in text:
            calls += [[name, inner] for inner in names(text)]
    for call in calls:
        lines += [f"## concordem {' '.join(call)}", "", "```text", run(program, *call, "--help").rstrip(), "```", ""]
    return {"commands.md": "\n".join(lines)}


# --- result file -------------------------------------------------------------------------------------------------

# Templates whose results have all groups and the histories of all laws, with what makes them short.
RUNS = {
    "cpm-small": [],
    "cpm-periodic": ["count = 1000", "count = 200"],
    "linear-bond-bar": [],
    "deformable-discs": [],
    "hertz-impact": [],
    "granular-box": ["count = 500", "count = 50", '["80 mm", "80 mm", "80 mm"]', '["40 mm", "40 mm", "40 mm"]'],
    "samples": ["count = 500", "count = 200", '["20 mm", "20 mm", "40 mm"]', '["14 mm", "14 mm", "24 mm"]'],
    "beam-bending": ["count = 1000", "count = 200", '["32 mm", "14 mm", "14 mm"]', '["24 mm", "10 mm", "10 mm"]'],
}
GROUPS = {
    "samples": "The time series: one value per sample.",
    "events": "One row per event: a bond whose damage passed `output.events_damage`, or that broke.",
    "particles": "The particles at the end of the run, one row each.",
    "contacts": "The contacts at the end of the run by law, one row each; `unbonded_LAW` contains unbonded contacts. "
    "Columns that begin with `history_` are the history of the law.",
    "cell": "The periodic cell at the end of the run, if there is one.",
    "VTKHDF": "Snapshots for ParaView: an unstructured grid with one vertex per particle (VTKHDF 2.0).",
    "provenance": "Provenance of the result. `scenario` is the text of the scenario; the rest are attributes.",
}


def results(program, run):
    import h5py

    tables = {}
    schema = Schema(json.loads(run(program, "schema")))
    words = [word for word, _ in schema.words(schema.root["$defs"]["Operator"])]
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)

        def make(item):
            name, changes = item
            path = folder / f"{name}.toml"
            if name == "samples":
                # Every operator; no template has them.
                path.write_text((ROOT / "tests/scenarios/good/samples.toml").read_text(encoding="utf-8"), encoding="utf-8")
            else:
                run(program, "init", "--template", name, path)
            text = path.read_text(encoding="utf-8")
            for old, new in zip(changes[::2], changes[1::2]):
                assert old in text, (name, old)
                text = text.replace(old, new)
            head, tail = re.split(r"^\[stop\].*$", text, maxsplit=1, flags=re.M)
            tail = re.split(r"^(?=\[)", tail, maxsplit=1, flags=re.M)[1]
            path.write_text(f"{head}[stop]\nsteps = 20\n\n{tail}", encoding="utf-8")
            run(program, "run", "--quiet", path)
            return path.with_suffix(".h5")

        with ThreadPoolExecutor(2) as pool:
            paths = list(pool.map(make, RUNS.items()))
        for path in paths:
            with h5py.File(path) as file:
                def note(name, item):
                    group, _, rest = name.partition("/")
                    if isinstance(item, h5py.Dataset) and group in GROUPS:
                        tables.setdefault(group, {}).setdefault(rest, describe(item))

                file.visititems(note)
                attributes = {"/": list(file.attrs), "/provenance": list(file["provenance"].attrs)}
    lines = ["# Datasets of a result", "", "This list was read from results of small runs. An array of shape (n, 3) has one row per particle, contact, event, or record.", ""]
    for group, text in GROUPS.items():
        rows = tables.get(group)
        lines += [f"## /{group}", "", text, ""]
        if group == "contacts" and rows:
            laws = sorted({name.split("/")[0] for name in rows} - {"walls"})
            first = columns(rows, laws[0])
            common = {key: first[key] for key in first if all(key in columns(rows, law) for law in laws)}
            lines += ["Columns of every law:", "", *listing(common)]
            for law in laws:
                own = {key: value for key, value in columns(rows, law).items() if key not in common}
                if law.removeprefix("unbonded_") == law or law.removeprefix("unbonded_") not in laws:
                    lines += [f"Further columns of `{law}`:", "", *listing(own)]
            lines += ["Columns of `walls`, the contacts with walls:", "", *listing(columns(rows, "walls"))]
        elif group == "samples":
            operators = sorted({name.split("/")[0] for name in rows if "/" in name})
            lines += listing({name: value for name, value in rows.items() if "/" not in name})
            for operator in operators:
                if operator in words:
                    lines += [f"### /samples/{operator}", "", *listing(columns(rows, operator))]
        elif rows:
            lines += listing(rows)
        if f"/{group}" in attributes:
            lines += ["Attributes: " + ", ".join(f"`{name}`" for name in attributes[f"/{group}"]) + ".", ""]
    lines += ["## Attributes of the file", "", ", ".join(f"`{name}`" for name in attributes["/"]) + ".", ""]
    return {"results.md": "\n".join(lines)}


def columns(rows, law):
    return {name.split("/", 1)[1]: value for name, value in rows.items() if name.split("/")[0] == law}


def describe(item):
    text = {key: value.decode() if isinstance(value, bytes) else str(value) for key, value in item.attrs.items()}
    shape = "scalar" if not item.shape else "(n)" if len(item.shape) == 1 else f"(n, {item.shape[1]})"
    kind = "string" if item.dtype == object else str(item.dtype)
    return shape, kind, text.get("unit", ""), text.get("description", "").rstrip(".") or meaning(item.name)


def listing(rows):
    lines = ["| Name | Shape | Type | Unit | Meaning |", "|---|---|---|---|---|"]
    for name, (shape, kind, unit, meaning) in rows.items():
        lines.append(f"| `{name}` | {shape} | {kind} | {unit} | {sentence(meaning)} |")
    return lines + [""]


def meaning(name):
    """Description of a dataset that its file lacks."""
    _, group, *_, key = name.split("/")
    return MEANINGS.get(f"{group}/{key}") or MEANINGS.get(key, "")


MEANINGS = {
    "particles/damage": "Mean damage of the particle's bonds; broken bonds count as 1",
    "particles/position": "Center",
    "deformation_gradient": "Deformation gradient of the cell since the start",
    "edges": "Matrix of the cell; its columns are the edge vectors",
    "velocity_gradient": "Velocity gradient of the cell",
    "history_damage_strain": "Damage strain of viscous damage",
    "history_kappa": "Largest equivalent strain so far",
    "history_normal_strain": "Normal strain",
    "history_omega": "Damage of the normal stiffness",
    "history_plastic_normal_strain": "Plastic normal strain in compression",
    "history_plastic_shear_strain": "Plastic shear strain",
    "history_shear_strain": "Shear strain",
    "history_normal_dashpot": "Normal dashpot force of the last step",
    "history_shear_dashpot": "Shear dashpot force of the last step",
    "history_shear_displacement": "Elastic shear displacement of B relative to A",
    "history_shear_force": "Elastic shear force on A",
    "history_rest_direction": "Direction of the unloaded bond, in axes halfway between those of the bodies",
    "history_rest_rotation": "Rotation from either body to these axes",
    "wall": "Number of the wall",
    "angular_velocity": "Angular velocity",
    "area": "Area of the cross-section",
    "branch": "From the center of A to that of B, periodic image included",
    "broken": "1 for a bond that broke",
    "damage": "Damage: 0 intact, 1 without strength",
    "displacement": "Displacement since the start",
    "force": "Force on A, or on the particle",
    "fragment": "Fragment: the smallest id of the particles that intact bonds connect",
    "id": "Stable id of the particle, in the order of the packing",
    "ids": "Stable ids of A and B",
    "length": "Distance of the centers",
    "lost_strength": "Fraction of its strength that the contact has lost",
    "mass": "Mass",
    "material": "Number of the material in the scenario, from 0",
    "moment": "Moment on A, or on the particle, about the contact point",
    "normal": "Unit vector from A to B",
    "position": "Contact point",
    "prescribed": "Prescribed degrees of freedom, one bit each",
    "radius": "Radius",
    "reference_length": "Length without strain",
    "rotation": "Rotation vector since the start",
    "sets": "Named sets, one bit each in the order of the scenario",
    "velocity": "Velocity",
}


# --- Python ------------------------------------------------------------------------------------------------------


def rust_docs():
    """Doc comments of the functions that Python sees: by (class or "", name)."""
    found, names = {}, {}
    for path in sorted((ROOT / "yade-bridge/src").glob("*.rs")):
        owner, doc, renamed = "", [], None
        for line in path.read_text(encoding="utf-8").splitlines():
            text = line.strip()
            if begin := re.match(r"impl(?:<.*?>)? (\w+)", line):
                owner = names.get(begin[1], begin[1])
            elif line == "}":
                owner = ""
            if name := re.search(r'#\[py(?:class|function|o3)\(.*\bname = "(\w+)"', text):
                renamed = name[1]
            if text.startswith("///"):
                doc.append(text[3:].strip())
            elif function := re.match(r"(?:pub(?:\([^)]*\))? )?(fn|struct) (?:__)?(\w+?)(?:__)?\b", text):
                name = renamed or function[2]
                if function[1] == "struct":
                    names[function[2]] = name
                if doc:
                    found.setdefault((owner, name), " ".join(doc))
                doc, renamed = [], None
            elif not text or text.endswith((";", "}")):
                doc, renamed = [], None
    return found


def signature(function):
    """A function as it is written in the stub."""
    arguments = ast.unparse(function.args).replace("self, ", "").replace("cls, ", "")
    arguments = "" if arguments in ("self", "cls") else arguments
    arguments = plain(re.sub(r"\bself, /$", "", arguments).removesuffix(", /"))
    arguments = re.sub(r"(?<=[\w\]])=(?=\S)", " = ", arguments)
    answer = plain(ast.unparse(function.returns)) if function.returns else ""
    return f"{function.name}({arguments})" + (f" -> {answer}" if answer not in ("", "None") else "")


def plain(annotation):
    """A type without the stub's private names."""
    return re.sub(r"\b_types\.|\b_(?=[A-Z])", "", annotation)


def entry(name, doc):
    return [f"`{name}`", f": {sentence(doc) or '(no description)'}", ""]


def stub_class(node, docs):
    lines = []
    for member in node.body:
        if not isinstance(member, ast.FunctionDef) or (member.name.startswith("__") and member.name != "__new__"):
            continue
        decorators = [ast.unparse(one) for one in member.decorator_list]
        doc = docs.get((node.name, member.name.strip("_")), "")
        if "property" in decorators:
            answer = plain(ast.unparse(member.returns))
            lines += entry(f"{member.name}: {answer}", doc)
        else:
            text = signature(member)
            if member.name == "__new__":
                text = text.replace("__new__", node.name)
                doc = doc or docs.get((node.name, "new"), "") or "Constructor."
            lines += entry(text, doc)
    return lines


def python_tree(name):
    return ast.parse((PACKAGE / name).read_text(encoding="utf-8"))


def named_tuples():
    """Classes of _types.py with their members' docstrings."""
    lines = []
    for node in python_tree("_types.py").body:
        if not isinstance(node, ast.ClassDef):
            continue
        lines += [f"### {node.name}", "", sentence(ast.get_docstring(node) or ""), ""]
        for member, doc in zip(node.body, node.body[1:]):
            if isinstance(member, ast.AnnAssign) and isinstance(doc, ast.Expr) and isinstance(doc.value, ast.Constant):
                lines += entry(f"{member.target.id}: {ast.unparse(member.annotation)}", doc.value.value)
    return lines


def module(path, title):
    """Public functions and classes of a Python module by their docstrings."""
    tree = python_tree(path)
    lines = []
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            lines += entry(signature(node), ast.get_docstring(node) or "")
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            lines += [f"### {node.name}", "", sentence(ast.get_docstring(node) or ""), ""]
            for member in node.body:
                if isinstance(member, ast.FunctionDef) and (not member.name.startswith("_") or member.name == "__init__"):
                    text = signature(member).replace("__init__", node.name)
                    if any(ast.unparse(one) == "property" for one in member.decorator_list):
                        text = f"{member.name}: {ast.unparse(member.returns)}"
                    doc = ast.get_docstring(member) or ("" if member.name != "__init__" else "Begin.")
                    lines += entry(text, doc)
    return [f"## {title}", "", *lines]


def python():
    stub = python_tree("_core.pyi")
    docs = rust_docs()
    classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef)}
    functions = {node.name: node for node in stub.body if isinstance(node, ast.FunctionDef)}

    def names(path):
        for node in python_tree(path).body:
            if isinstance(node, ast.ImportFrom) and node.module == "_core":
                yield from ((one.name, one.asname or one.name) for one in node.names)

    lines = ["# Python package", "", "Arrays are in SI units; tension is positive. `Reals` is an array of 64-bit floats, `Path` a string or path, `Progress` true,",
             "false, or a function of a stage and a fraction from 0 to 1. Truncation and partition take the words of a scenario.", "", "## concordem", ""]
    described = []

    def add(path, prefix):
        out = []
        for name, shown in names(path):
            if name in functions:
                out += entry(signature(functions[name]).replace(name, f"{prefix}{shown}", 1), docs.get(("", name), ""))
        for name, _ in names(path):
            if name in classes and name not in described:
                described.append(name)
                out += [f"### {name}", "", sentence(docs.get(("", name), "")), "", *stub_class(classes[name], docs)]
        return out

    lines += add("__init__.py", "")
    lines += ["## concordem.operators", "", *add("operators.py", "")]
    lines += ["## concordem.packing", "", *add("packing.py", "")]
    lines += ["## Result types", "", *named_tuples()]
    lines += ["## Errors", ""]
    for node in python_tree("_errors.py").body:
        if isinstance(node, ast.ClassDef):
            base = ", ".join(ast.unparse(one) for one in node.bases)
            lines += entry(f"{node.name}({base})", ast.get_docstring(node) or "")
    lines += module("liggghts.py", "concordem.liggghts")
    lines += ["## concordem.yade", ""]
    public = ast.literal_eval(next(n.value for n in python_tree("yade/__init__.py").body if isinstance(n, ast.Assign)))
    for path in ("yade/_engine.py", "yade/_handover.py", "yade/_scene.py", "yade/_native.py"):
        tree = python_tree(path)
        for node in tree.body:
            name = {"load": "load_native"}.get(node.name, node.name) if isinstance(node, ast.FunctionDef) and path.endswith("_native.py") else getattr(node, "name", "")
            if name not in public:
                continue
            if isinstance(node, ast.FunctionDef):
                lines += entry(signature(node).replace(node.name, name, 1), ast.get_docstring(node) or "")
            else:
                lines += entry(f"class {node.name}", ast.get_docstring(node) or "")
                for member in node.body:
                    if isinstance(member, ast.FunctionDef) and not member.name.startswith("_"):
                        text = signature(member)
                        if any(ast.unparse(one) == "property" for one in member.decorator_list):
                            text = f"{member.name}: {ast.unparse(member.returns)}"
                        lines += entry(f"{node.name}.{text}", ast.get_docstring(member) or "")
    return {"python.md": "\n".join(lines)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--concordem", type=Path, default=ROOT / "target/release/concordem", help="the program")
    program = parser.parse_args().concordem.resolve()

    def run(*arguments):
        done = subprocess.run(arguments, check=False, capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"{' '.join(map(str, arguments))}:\n{done.stderr}")
        return done.stdout

    pages = {**scenario(program, run), **commands(program, run), **results(program, run), **python()}
    TARGET.mkdir(parents=True, exist_ok=True)
    for path in TARGET.glob("*.md"):
        if path.name not in pages:
            path.unlink()
    for name, text in pages.items():
        path, text = TARGET / name, NOTE + text.rstrip() + "\n"
        # Pages that did not change need no new build.
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
