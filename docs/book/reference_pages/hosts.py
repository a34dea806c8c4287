"""The pages of the hosts' commands and of public decks, from what liggghts-bridge/tests/host_commands.rs and public_decks.rs run."""

import json
import tomllib

from .text import ROOT, sentence

TABLES = ROOT / "liggghts-bridge/tests/host_commands"
HOSTS = {"LIGGGHTS": "liggghts", "LAMMPS": "lammps"}
INTRODUCTION = """# Commands of the hosts

What commands of LIGGGHTS 3.8.0 and LAMMPS (22 July 2025) do beside styles of ConcorDEM: every style that the programs list, and commands of scripts that
act on atoms, bonds, lists, or boxes.

- **As alone**: a small script with the host's own contacts or bonds, and with ours of the same law, ends with the same atoms; if the command
  concerns what processes exchange, also on two.
- **Refused**, **warned**: the run ends, or warns, with the text in the last column.
- **No script**: lists below each table, with the reason.
"""


def names(commands):
    return ", ".join(f"`{name}`" for name in commands)


def row(of, decks):
    """Result and note of a row."""
    notes = []
    if of.get("decks"):
        notes.append("with " + " and ".join(decks[name]["says"] for name in of["decks"]))
    if of.get("says"):
        notes.append(sentence(of["says"]))
    if of.get("warned"):
        return "warned", f"`{of['warned']}`"
    if of.get("refused"):
        return "refused", f"`{of['refused'].replace('`', '')}`" + "".join(f"; {note}" for note in notes)
    if of.get("test"):
        return "as alone" if not of.get("says") else "tested", "; ".join([*notes, f"`{of['test'].split('::')[1]}`"])
    return "as alone", "; ".join(notes)


def page(host, table):
    """Sections of a host."""
    lines = [f"## {host}", "", "| Command | Result | |", "|---|---|---|"]
    for of in table["row"]:
        result, note = row(of, table["decks"])
        lines.append(f"| {names(of['commands'])} | {result} | {note} |")
    lines += ["", f"### {host}: no script", ""]
    for of in table["class"]:
        lines.append(f"- {sentence(of['says'])}: {names(of['commands'])}")
    return [*lines, ""]


DECKS = """# Public decks on our styles

Scripts that others have published for LIGGGHTS and LAMMPS, rebuilt small, with styles of ConcorDEM. The tests run them beside the host's own styles;
`make host-decks` on 1, 2, 4, and 8 processes.

- **Lines**: how many change. Most are `pair_style`, `pair_coeff`, `fix wall/gran`, or `bond_style`, `bond_coeff`, and the integrator. The scripts are in
  `liggghts-bridge/tests/public_decks/`.
- **From stock**: the largest difference of positions, velocities, spins, forces, and torques from the host's own styles at the end, relative to the largest magnitude, on
  any of these numbers of processes; and how both scripts are compared.
- **From one process**: the largest difference of our run on 2, 4, or 8 processes from the run on one; 0: the same bits.
"""


RANDOM = {
    "scripts": "Random scripts of bodies that collide and break: {drawn} have the same bits on 2, 4, or 8 processes and after a restart on another number.",
    "commands": "Random sets of the rows of [Commands of the hosts](host-commands.md): {drawn} drawn, of which the host takes {ran}; all end as with the host's styles.",
}


def largest(runs, key):
    """The largest difference of a deck's runs."""
    numbers = [run[key] for run in runs if key in run]
    return "–" if not numbers else "0" if max(numbers) == 0 else f"{max(numbers):.0e}"


def decks_of(host, decks):
    """Table of the public decks of a host."""
    lines = [f"## {host}", "", "| Deck | Source | Lines | From stock | From one process |", "|---|---|---|---|---|"]
    for deck in decks:
        what = sentence(f"{deck['deck']}: {deck['says']}") + (f"; left out: {deck['misses']}" if "misses" in deck else "")
        stock = f"{largest(deck['runs'], 'from_stock')}, {deck['compared']}" if "from_stock" in deck["runs"][0] else deck["compared"]
        one = largest(deck["runs"], "from_one") + (f", {deck['over_processes']}" if "over_processes" in deck else "")
        project, file = deck["source"].split(": ")
        lines.append(f"| {what} | {project}: `{file}` | {deck['changed_lines']} | {stock} | {one} |")
    return [*lines, ""]


def page_of_decks():
    """The page of public decks, from the record."""
    record = json.loads((ROOT / "validation/results/host-decks.json").read_text())
    lines = [DECKS]
    for host, decks in record["public"].items():
        lines += decks_of(host, decks)
    for kind, what in RANDOM.items():
        found = record.get("random", {}).get(kind)
        if found:
            lines += [f"- {what.format(**found)}"]
    return "\n".join(lines)


def pages():
    """The pages, by file name."""
    lines = [INTRODUCTION]
    for host, name in HOSTS.items():
        text = "".join(file.read_text() for file in sorted((TABLES / name).glob("*.toml")))
        lines += page(host, tomllib.loads(text))
    return {"host-commands.md": "\n".join(lines), "host-decks.md": page_of_decks()}
