"""The page of the datasets of a result, read from small runs."""

import json
import re
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from .schema import Schema
from .text import ROOT, sentence

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
    "joint": "Number of the `[[joint]]` that the bond lies across, from 0; 65535 off joints; with joints only",
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
    "strength_factor": "Factor on the strength (of a particle: on those of its bonds), with `strength_scatter` or `strength_factors` only",
    "sets": "Named sets, one bit each in the order of the scenario",
    "velocity": "Velocity",
}


def pages(program, run):
    """The page, by file name."""
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
