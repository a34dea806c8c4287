"""The page of the Python package, from its stub, its docstrings, and the doc comments of its Rust functions; nothing is imported."""

import ast
import re

from .text import ROOT, sentence

PACKAGE = ROOT / "rust-core/python/python/concordem"


def rust_docs():
    """Doc comments of the functions that Python sees: by (class or "", name)."""
    found, names = {}, {}
    for path in sorted([*(ROOT / "rust-core/python/src").glob("*.rs"), *(ROOT / "yade-bridge/src").glob("*.rs")]):
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
    # Examples are lines of a terminal, which a sentence cannot hold.
    doc = doc.split(">>>")[0].rstrip()
    doc = re.sub(r"\b(Parameters|Returns|Raises)\s+-{3,}", r"*\1:*", doc)
    return [f"`{name}`", f": {sentence(doc) or '(no description)'}", ""]


def stub_class(node, docs):
    lines = []
    for member in node.body:
        if not isinstance(member, ast.FunctionDef) or (member.name.startswith("__") and member.name != "__new__"):
            continue
        decorators = [ast.unparse(one) for one in member.decorator_list]
        # Methods that Python adds have their docstrings in the stub.
        doc = docs.get((node.name, member.name.strip("_")), "") or ast.get_docstring(member) or ""
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


def pages():
    """The page, by file name."""
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

    lines += [*add("__init__.py", ""), *module("_plot.py", "")[2:]]
    lines += ["## concordem.operators", "", *add("operators.py", "")]
    lines += ["## concordem.packing", "", *add("packing.py", ""), *module("packing.py", "")[2:], *module("_memoized.py", "")[2:]]
    lines += module("laws.py", "concordem.laws")
    lines += ["## concordem.coupling", "", *add("coupling/__init__.py", "")]
    for path in ("_protocol", "_materials", "_scikit", "_sequential", "_embedding", "_volume", "_pictures"):
        lines += module(f"coupling/{path}.py", "")[2:]
    lines += module("inference/_posterior.py", "concordem.inference")
    for path in ("_ensemble", "_quantities"):
        lines += module(f"inference/{path}.py", "")[2:]
    lines += module("datasets.py", "concordem.datasets")
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
