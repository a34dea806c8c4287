"""The page of the laws' parameters, as LIGGGHTS, LAMMPS, and scenarios take them: from the program's schema, which the Rust tables declare."""

import json
import re

from .schema import Schema, bounds, definition, toml
from .text import ROOT, sentence

LAWS = ROOT / "rust-core/contact/src/law"
BRIDGE = ROOT / "liggghts-bridge"

#: Tables beside those of the laws: prefix of their keys in the hosts, title, file, what switches them on.
OTHERS = {
    "deformable": ("deformable.", "Deformable particles", "rust-core/contact/src/material.rs", "and act with `deformable CONDITION`."),
    "thermal": ("thermal.", "Thermal constants", "rust-core/contact/src/material.rs", "and act with `heat FILE`."),
}

#: Pages of the theory whose name is not that of the law.
THEORY = {"hertz_mindlin": "hertz-mindlin", "linear_bond": "linear-bond", "cohesive_beam": "cohesive-beam", "damped_beam": "cohesive-beam", "softening_beam": "cohesive-beam"}

INTRODUCTION = """# Parameters of the laws

The program, LIGGGHTS, and LAMMPS take the same parameters. These tables are generated from their declarations in the code.

| In | A parameter is given as |
|---|---|
| LIGGGHTS, and LAMMPS' `fix concordem/bond` | `KEY VALUE` after the law; for a contact law that differs from the bond law: `contact.KEY VALUE` |
| LAMMPS' `bond_style`, `pair_style` | `KEY VALUE` in `bond_coeff`, `pair_coeff` |
| a file of `materials FILE` | `KEY = VALUE` in `[material.LAW]`, one `[[material]]` per atom type; `[interface.LAW]` for contacts of two types |
| a scenario | the same: [material](scenario-material.md) |

**Units.** A number without a unit is in SI units, the first unit of its row. A value with one of the units is in quotes: `young "30 GPa"`. Units of
another dimension are rejected. LIGGGHTS and LAMMPS must run with `units si`.

**Default.** A key without a default ("none") may be left out; its meaning says what then happens, or which key replaces it.

**Unknown keys** and values out of range are rejected; the message says what is allowed. Scripts may write true as `yes`, `true`, `on`, and
false as `no`, `false`, `off`.
"""


def file_of(law):
    """The file with the table of a law, the source of its row here."""
    name = re.sub(r"(?:^|_)(\w)", lambda match: match[1].upper(), law) + "Table"
    for path in (LAWS / f"{law}.rs", LAWS / law / "table.rs"):
        # As a struct, or by the macro of the tables of beams.
        if path.exists() and re.search(rf'^pub struct {name} |^    {name}, "', path.read_text(encoding="utf-8"), re.MULTILINE):
            return f"`{path.relative_to(ROOT)}` (`{name}`)"
    raise SystemExit(f"no file in {LAWS} declares {name}")


def unit_and_allowed(schema, root):
    """The units, SI first, and what is allowed, of one parameter."""
    inner = root.resolve(schema)
    both = {**inner, **{key: value for key, value in schema.items() if key != "description"}}
    if "x-dimension" in both:
        units = both["x-units"]
        limit = bounds(both)
        return ", ".join(units), limit or "any number"
    words = root.words(inner)
    if words:
        return "", " or ".join(f"`{word}`" for word, _ in words)
    if both.get("type") == "boolean" or "boolean" in both.get("type", []):
        return "", "true or false"
    if root.kinds(inner):
        kinds = " or ".join(f"`{kind}`" for kind in root.kinds(inner))
        return "", f"a table of kind {kinds}, with `materials FILE` only"
    if both.get("type") == "array" or "array" in both.get("type", []):
        return unit_and_allowed(inner["items"], root)[0], "a list, with `materials FILE` only"
    if root.is_table(inner):
        return "", "a table, with `materials FILE` only"
    raise SystemExit(f"a parameter of an unknown type: {schema}")


def default(schema, required):
    if required:
        return "required"
    if schema.get("default") in (None, "", []):
        return "none"
    # Words without quotes, as in the column before.
    value = schema["default"]
    return f"`{value if isinstance(value, str) else toml(value)}`"


def table(schema, definition_name, refused):
    """The rows of a table of parameters."""
    properties = schema.root["$defs"][definition_name]
    lines = ["| Key | Meaning | Unit | Allowed | Default |", "|---|---|---|---|---|"]
    for key, one in properties["properties"].items():
        unit, allowed = unit_and_allowed(one, schema)
        meaning = sentence(one.get("description", "")) + (f" **{refused[key]}**" if key in refused else "")
        cells = [f"`{key}`", meaning, unit, allowed, default(one, key in properties.get("required", []))]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return [*lines, ""]


def refused_keys():
    """Keys that the hosts reject, with what the tables say about them; the parser must still reject them."""
    options = (BRIDGE / "src/options.rs").read_text(encoding="utf-8")
    heat = (BRIDGE / "src/options/heat.rs").read_text(encoding="utf-8")
    assert "`hydrostatic_strength`: failure of whole particles is not available here" in options
    assert '("stiffness", variation' in heat and '("strength", variation' in heat
    return {"hydrostatic_strength": "Rejected in LIGGGHTS and LAMMPS."}


def gran_models():
    """The models of `pair_style gran` with the properties that each reads, from their declaration."""
    text = (BRIDGE / "src/pair/models.rs").read_text(encoding="utf-8")
    shim = (BRIDGE / "shim/pair_model.cpp").read_text(encoding="utf-8")
    # if (reads(CONCORDEM_BIT)) { young = per_type("NAME"); ... }, or one statement without braces
    names = {}
    for bit, block, statement in re.findall(r"if \(reads\(CONCORDEM_(\w+)\)\)\s*(?:\{(.*?)\}|(.*?);)", shim, re.S):
        names[bit] = re.findall(r'(?:per_type|per_pair|property)\("(\w+)"', block or statement)
    lines = ["| Model | Law | Properties (`fix property/global`) |", "|---|---|---|"]
    for maker, name, bits in re.findall(r'^\s+(liggghts|concordem)\(c"([\w/]+)", \d+, ([A-Z |]+), \w+\),$', text, re.M):
        read = [one for bit in bits.split(" | ") for one in names[bit]]
        if maker == "concordem":
            law = f"ConcorDEM's [{name.split('/')[1]}](#{name.split('/')[1]}), which includes the shear force"
            read.append("coefficientFriction")
        else:
            law = "LIGGGHTS' own formulas, `tangential off`, `no_history`, or `history`"
            read.append("coefficientFriction (not with `tangential off`)")
        lines.append(f"| `{name}` | {law} | {', '.join(read)} |")
    assert len(lines) == 2 + text.count('(c"concordem/') and all(names.values()), names
    per_type = re.findall(r'per_type\("(\w+)"', shim)
    pair = sorted(set(re.findall(r'per_pair\("(\w+)"', shim)))
    scalar = re.findall(r'property\("(\w+)", "scalar"', shim)
    return [
        *lines,
        "",
        f"Per atom type (`peratomtype`): {', '.join(per_type)}. Per pair of types (`peratomtypepair`): {', '.join(pair)}. "
        f"One number (`scalar`): {', '.join(scalar)}.",
        "",
    ]


def pages(program, run):
    """The page, by file name."""
    schema = Schema(json.loads(run(program, "schema")))
    material = schema.root["$defs"]["Material"]["properties"]
    as_bond = dict(schema.words(schema.root["$defs"]["LawName"]))
    as_contact = dict(schema.words(schema.root["$defs"]["ContactLawName"]))
    laws = [name for name in material if name in as_bond or name in as_contact]
    assert set(as_bond) | set(as_contact) - {"none"} == set(laws), "a law without a table"
    refused = refused_keys()
    lines = [INTRODUCTION]
    for law in laws:
        name = definition(material[law])
        roles = []
        if law in as_bond:
            roles += [f"As a bond (`fix concordem/bond {law}`, `bond_style concordem/{law}`): {sentence(as_bond[law])}", ""]
        if law in as_contact:
            roles += [f"As a contact (`contact {law}`, `pair_style concordem/{law}`): {sentence(as_contact[law])}", ""]
        theory = THEORY.get(law, law)
        lines += [f"## {law}", "", *roles, *table(schema, name, refused)]
        for key, one in schema.root["$defs"][name]["properties"].items():
            words = schema.words(schema.resolve(one))
            if words and any(meaning for _, meaning in words):
                lines += [f"`{key}`: " + "; ".join(f"`{word}`: {sentence(meaning).rstrip('.')}" for word, meaning in words) + ".", ""]
        source = f"Declared in {file_of(law)}."
        page = ROOT / f"docs/book/theory/{theory}.md"
        lines += [source + (f" Equations: [theory](../../theory/{theory}.md)." if page.exists() else ""), ""]
    for key, (prefix, title, source, switch) in OTHERS.items():
        name = definition(material[key])
        assert f"pub struct {name} " in (ROOT / source).read_text(encoding="utf-8"), (name, source)
        lines += [f"## {title}", "", f"In a script, these keys have the prefix `{prefix}` {switch}", "", *table(schema, name, {}), f"Declared in `{source}` (`{name}`).", ""]
        for inner, one in schema.root["$defs"][name]["properties"].items():
            inner_name = definition(one)
            if inner_name and schema.is_table(schema.resolve(one)):
                hosts = {"stiffness": "Rejected in LIGGGHTS and LAMMPS.", "strength": "Rejected in LIGGGHTS and LAMMPS."}
                lines += [f"### {prefix}{inner}", "", *table(schema, inner_name, hosts)]
    lines += ["## Models of pair_style gran", "", "Of LIGGGHTS: [pair_style gran and fix wall/gran](../liggghts/gran-models.md).", "", *gran_models()]
    return {"laws.md": "\n".join(lines)}
