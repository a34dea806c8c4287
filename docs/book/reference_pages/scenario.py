"""Pages of the tables of a scenario: every key, with its type, its default, and an example."""

import json
import re
import tempfile
import tomllib
from pathlib import Path

from .schema import Schema, definition, examples, toml, type_of
from .text import ROOT, sentence

# The order of pages, and the titles of those whose key says too little.
TABLES = {
    "top": "Top level",
    "packing": "packing",
    "material": "material",
    "interface": "interface",
    "bonds": "bonds",
    "bonding": "bonding",
    "aggregates": "aggregates",
    "phases": "phases",
    "fibers": "fibers",
    "cut": "cut",
    "joint": "joint",
    "contacts": "contacts",
    "deformable": "deformable",
    "wall": "wall",
    "membrane": "membrane",
    "set": "set",
    "clump": "clump",
    "prescribe": "prescribe",
    "slave": "slave",
    "force": "force",
    "initial": "initial",
    "heat": "heat",
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
    ("CohesiveBeam", None, "friction_coefficient"): 0.7,
    ("CohesiveBeam", None, "hydrostatic_strength"): "64 MPa",
    ("CohesiveBeam", None, "model"): "timoshenko",
    ("CohesiveBeam", None, "radius"): "0.7 mm",
    ("CohesiveBeam", None, "shear_coefficient"): 0.9,
    ("CohesiveBeam", None, "shear_ratio"): 0.3,
    ("Output", None, "events_damage"): 0.5,
    ("Packing", "cooker", "overlap"): 0.01,
    ("Packing", "cooker", "radius"): "1 mm",
    ("Packing", "cooker", "solid_fraction"): 0.6,
    ("Packing", "random-discs", "radius"): "0.1 mm",
    ("Packing", "random-discs", "solid_fraction"): 0.9,
    ("Radii", "table", "radii"): ["1 mm", "1.5 mm"],
    ("Radii", "table", "shares"): [0.7, 0.3],
    ("Shape", "mesh", "path"): "specimen.stl",
    ("Shape", "mesh", "unit"): "1 mm",
}


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


def pages(program, run):
    """One page per table, by file name."""
    schema = Schema(json.loads(run(program, "schema")))
    documents = []
    with tempfile.TemporaryDirectory() as folder:
        for name in templates(program, run):
            run(program, "init", "--template", name, folder)
        for path in [*sorted(Path(folder).glob("*.toml")), *sorted((ROOT / "tests/scenarios/good").glob("*.toml"))]:
            document = tomllib.loads(path.read_text(encoding="utf-8-sig"))
            if "packing" in document:
                documents.append(document)
    written = ScenarioPages(schema, examples(schema, documents))
    unknown = set(schema.root["properties"]) - set(TABLES) - {"version", "title", "author", "dimension", "kinematics"}
    assert not unknown, f"new tables of scenarios: {unknown}"
    return {f"scenario-{key}.md": written.page(key) for key in TABLES}


def templates(program, run):
    return re.findall(r"^  (\S+)  ", run(program, "init"), re.M)
