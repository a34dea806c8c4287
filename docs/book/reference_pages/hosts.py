"""The page of the hosts' commands, from the tables that liggghts-bridge/tests/host_commands.rs runs."""

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


def pages():
    """The page, by file name."""
    lines = [INTRODUCTION]
    for host, name in HOSTS.items():
        text = "".join(file.read_text() for file in sorted((TABLES / name).glob("*.toml")))
        lines += page(host, tomllib.loads(text))
    return {"host-commands.md": "\n".join(lines)}
