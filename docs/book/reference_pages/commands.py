"""The page of the commands: the help of the program and of each command."""

import re


def pages(program, run):
    """The page, by file name."""
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
