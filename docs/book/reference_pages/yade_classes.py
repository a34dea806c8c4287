"""A page for each class of the native YADE plugin, as in YADE's own reference, from the declarations that YADE's Python shows: those in
the shim's headers, and those that the functor generator writes for all other laws."""

import re
import tempfile
from pathlib import Path

from .text import ROOT, sentence

SHIM = ROOT / "yade-bridge/native/shim"
#: What YADE's flags of an attribute mean; hidden attributes are for saving.
FLAGS = {"readonly": "read-only", "noSave": "not saved"}


def parts(text):
    """The parts of a list of C++ arguments."""
    depth, quoted, part, found = 0, False, "", []
    for k, letter in enumerate(text):
        if letter == '"' and text[k - 1] != "\\":
            quoted = not quoted
        if not quoted:
            depth += (letter in "({") - (letter in ")}")
            if letter == "," and depth == 0:
                found.append(part.strip())
                part = ""
                continue
        part += letter
    return [*found, part.strip()]


def inside(text, start):
    """What is between the parenthesis at `start` and its partner, and where that is."""
    depth, quoted = 0, False
    for k in range(start, len(text)):
        if text[k] == '"' and text[k - 1] != "\\":
            quoted = not quoted
        elif not quoted:
            depth += (text[k] == "(") - (text[k] == ")")
            if depth == 0:
                return text[start + 1 : k], k
    raise SystemExit(f"an unbalanced declaration: {text[start : start + 80]}")


def words(literal):
    """The text of a C++ string; adjacent ones are joined."""
    return "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', literal)).replace('\\"', '"').replace("\\\\", "\\")


def default(kind, value):
    """A default as Python shows it."""
    plain = {"Vector3r::Zero()": "(0, 0, 0)", "Vector6r::Zero()": "(0, 0, 0, 0, 0, 0)", "true": "True", "false": "False"}
    if value in plain:
        return plain[value]
    if "infinity" in value:
        return "inf"
    return value or {"string": '""'}.get(kind, "[]" if kind.startswith("vector") else "")


def attributes(text):
    """Name, type, default, flags, and description of each attribute."""
    found, k = [], text.find("((")
    while k >= 0:
        item, end = inside(text, k)
        kind, name, value, flags, doc = parts(item.strip()[1:-1])
        flags = re.findall(r"Attr::(\w+)", flags)
        if "hidden" not in flags:
            kind = kind.replace("Body::id_t", "int")
            found.append((name, kind, default(kind, value), [FLAGS[flag] for flag in flags if flag in FLAGS], words(doc)))
        k = text.find("((", end)
    return found


def members(text):
    """Signature and description of each method and property."""
    found = []
    for call in re.finditer(r"\.(def|add_property)\(", text):
        given = parts(inside(text, call.end() - 1)[0])
        name, doc = words(given[0]), words(given[-1])
        arguments = ", ".join(re.findall(r'arg\("(\w+)"\)', "".join(given[2:-1])))
        found.append((name if call[1] == "add_property" else f"{name}({arguments})", doc))
    return found


def classes(text):
    """The classes of a source file: name, base, description, attributes, members."""
    text = re.sub(r"/\*(?!\w+\*/).*?\*/", "", text, flags=re.S)
    for macro in re.finditer(r"YADE_CLASS_BASE_DOC(\w*)\(", text):
        given = parts(inside(text, macro.end() - 1)[0])
        name, base, doc = given[:3]
        attrs = attributes(given[3]) if "ATTRS" in macro[1] else []
        methods = members(given[-1]) if macro[1].endswith("PY") else []
        yield name, base, words(doc), attrs, methods


def prose(text):
    """A description that the book does not read as markup, but for code."""
    return "".join(part if part.startswith("`") else part.replace("*", "\\*") for part in re.split(r"(`[^`]*`)", sentence(text)))


def page(name, base, doc, attrs, methods, known):
    shown = f"[{base}](yade-{base}.md)" if base in known else f"{base} of YADE"
    lines = [f"# {name}", "", f"Base class: {shown}, whose attributes it has, too.", "", prose(doc), ""]
    if attrs:
        lines += ["## Attributes", ""]
        for attribute, kind, value, flags, description in attrs:
            facts = ", ".join([kind, *([f"default {value}"] if value else []), *flags])
            lines += [f"`{attribute}` ({prose(facts)})", f": {prose(description)}", ""]
    if methods:
        lines += ["## Methods and properties", ""]
        for method, description in methods:
            lines += [f"`{method}`", f": {prose(description)}", ""]
    return "\n".join(lines)


def pages(program, run):
    """The pages, by file name."""
    with tempfile.TemporaryDirectory() as folder:
        run(program.parent / "concordem-yade-functors", SHIM, folder)
        generated = (Path(folder) / "laws.cpp").read_text(encoding="utf-8")
    sources = [path.read_text(encoding="utf-8") for path in sorted(SHIM.glob("*.hpp"))]
    found = {one[0]: one for text in (*sources, generated) for one in classes(text)}
    groups = {"Materials": "Mat_Rust", "States": "State_Rust", "Physics of interactions": "Phys_Rust", "Functors": "", "Engines": ""}
    lists = {title: [] for title in groups}
    for name in sorted(found):
        if name.startswith(("Ip2_", "Law2_")):
            lists["Functors"].append(name)
        else:
            title = next((title for title, end in groups.items() if end and name.endswith(end)), "Engines")
            lists[title].append(name)
    lines = ["# Classes of the native plugin", "",
             "What `concordem.yade.load_native()` adds to YADE. Classes without headers are in the [Python package](python.md).", ""]
    for title, names in lists.items():
        lines += [f"## {title}", ""]
        for name in names:
            first = re.split(r"(?<=[a-z]\.) ", found[name][2])[0]
            lines += [f"[{name}](yade-{name}.md)", f": {prose(first)}", ""]
    lines += ["```{toctree}", ":hidden:", "", *(f"yade-{name}" for names in lists.values() for name in names), "```"]
    return {"yade-classes.md": "\n".join(lines), **{f"yade-{name}.md": page(*one, found) for name, one in found.items()}}
