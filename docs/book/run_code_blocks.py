#!/usr/bin/env python3
"""Run every ```sh, ```python, and ```toml block of the book, page by page, each page in a temporary folder; check the scenario of the README.

A comment on the line before a block says what is special about it; several words may follow each other:

    <!-- code: file=NAME -->       write the block to NAME (a whole scenario is checked with `concordem check`, too)
    <!-- code: fragment -->        part of a scenario: keys, types, and words are checked against the JSON Schema
    <!-- code: fragment=TEMPLATE -->  the same, and put into that template, with which `concordem check` must agree
    <!-- code: needs=WHAT -->      runs with --hosts only. WHAT: package (the Python package concordem, with --package, too), grainlearning
                                  (if this Python has it, too), yade, liggghts, lammps
    <!-- code: slow -->            takes minutes; runs with --slow only
    <!-- code: fails=STATUS -->    must end with this exit status
    <!-- code: shown REASON -->    never run: changes the machine, or is no complete program
    <!-- check: COMMAND -->        what the page promises of the block before: the command must succeed (stands alone)
    <!-- quicker: COMMAND -->      changes a file of the page, so that blocks of which no numbers are shown take less time (stands alone)
    <!-- copy: PATH [NAME] -->     copies a file of the repository to the page's folder (stands alone)
    <!-- tasks: COUNT -->          the page has so many sections; each takes at most ten lines and five minutes (stands alone)

Blocks of one page share the folder; Python blocks of one page share their variables.
"""

import argparse
import contextlib
import importlib.util
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
import traceback
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

BOOK = Path(__file__).resolve().parent
ROOT = BOOK.parents[1]
LANGUAGES = ("sh", "python", "toml")
FENCE = re.compile(r"^(?P<indent> *)```(?P<language>\w+)\s*$")
MARK = re.compile(r"^\s*<!-- (?P<kind>code|copy|check|quicker): (?P<words>.*?) -->\s*$")
LIMIT = 600  # seconds for one block
TASKS = re.compile(r"^<!-- tasks: (\d+) -->$", re.MULTILINE)
TASK_LINES, TASK_SECONDS = 10, 300


@dataclass
class Block:
    line: int
    language: str
    text: str
    words: dict = field(default_factory=dict)


def blocks_of(page):
    """The blocks and copies of a page, in order."""
    found, marks, lines = [], {}, page.read_text(encoding="utf-8").splitlines()
    at = 0
    while at < len(lines):
        mark, fence = MARK.match(lines[at]), FENCE.match(lines[at])
        if mark and mark["kind"] in ("copy", "check", "quicker"):
            found.append(Block(at + 1, mark["kind"], mark["words"]))
        elif mark:
            words = mark["words"].split()
            marks = {"shown": " ".join(words[1:])} if words[0] == "shown" else dict((w.split("=", 1) + [""])[:2] for w in words)
        elif fence:
            start, indent = at, len(fence["indent"])
            at += 1
            while lines[at].strip() != "```":
                at += 1
            text = "\n".join(line[indent:] for line in lines[start + 1 : at]) + "\n"
            if fence["language"] in LANGUAGES:
                found.append(Block(start + 1, fence["language"], text, marks))
            marks = {}
        elif lines[at].strip().startswith("```"):
            at += 1
            while lines[at].strip() != "```":
                at += 1
            marks = {}
        elif lines[at].strip():
            if marks:
                raise SystemExit(f"{page}:{at + 1}: a code mark without a block")
        at += 1
    return found


class Failed(Exception):
    pass


def relaxed(schema):
    """The schema of parts of a scenario: nothing is required, and one of several kinds is enough."""
    if isinstance(schema, dict):
        schema = {("anyOf" if key == "oneOf" else key): relaxed(value) for key, value in schema.items() if key != "required"}
        # A scenario writes an optional key by leaving it out.
        return schema
    return [relaxed(one) for one in schema] if isinstance(schema, list) else schema


class Page:
    """One page's folder and variables."""

    def __init__(self, path, options, folder):
        self.path, self.options, self.folder = path, options, Path(folder)
        self.names = {"__name__": "__main__"}
        self.counts = {"run": 0, "shown": 0, "left out": 0}
        self.seconds = {}
        self.number = 0
        self.left_out = False  # whether the last block did not run
        home = options.concordem.parent
        paths = [str(home), str(Path(sys.executable).parent), str(ROOT / "target/liggghts")]
        self.environment = dict(os.environ, PATH=os.pathsep.join([*paths, os.environ["PATH"]]), MPLBACKEND="Agg")
        self.environment["LAMMPS_PLUGIN_PATH"] = str(ROOT / "target/lammps")
        # Python blocks run in this process, which is that of the page alone.
        os.environ.update(self.environment)

    def run(self):
        for block in blocks_of(self.path):
            # The README has no marks: its scenario is checked, its commands install, or stand in the tutorials.
            if self.path.name == "README.md" and block.language != "toml":
                continue
            begin = time.monotonic()
            try:
                done = self.block(block)
            except Failed as error:
                raise Failed(f"{self.path.relative_to(ROOT)}:{block.line}: {error}") from None
            self.seconds[block.line] = time.monotonic() - begin
            if self.options.verbose and done:
                print(f"  {self.seconds[block.line]:6.1f} s  {os.path.relpath(self.path, BOOK)}:{block.line}")
        self.check_tasks()
        return self.counts

    def check_tasks(self):
        """Tasks are short, and so are their runs."""
        text = self.path.read_text(encoding="utf-8")
        mark = TASKS.search(text)
        if not mark:
            return
        starts = [k + 1 for k, line in enumerate(text.splitlines()) if line.startswith("## ")]
        if len(starts) != int(mark[1]):
            raise Failed(f"{self.path.relative_to(ROOT)}: {len(starts)} tasks instead of {mark[1]}")
        for start, end in zip(starts, [*starts[1:], 10**6], strict=True):
            blocks = [block for block in blocks_of(self.path) if start < block.line < end and block.language in LANGUAGES]
            lines = sum(1 for block in blocks for line in block.text.splitlines() if line.strip())
            seconds = sum(self.seconds.get(block.line, 0) for block in blocks)
            if not 0 < lines <= TASK_LINES or seconds > TASK_SECONDS:
                raise Failed(f"{self.path.relative_to(ROOT)}:{start}: the task takes {lines} lines and {seconds:.0f} s")

    def block(self, block):
        if block.language == "copy":
            source, *name = block.text.split()
            if not (ROOT / source).is_file():
                raise Failed(f"there is no {source} in the repository")
            shutil.copy(ROOT / source, self.folder / (name[0] if name else Path(source).name))
            return False
        if block.language in ("check", "quicker"):
            if not self.left_out:
                self.command(["bash", "-euo", "pipefail", "-c", block.text])
            return False
        unknown = set(block.words) - {"file", "fragment", "needs", "slow", "fails", "shown"}
        if unknown:
            raise Failed(f"unknown mark {', '.join(unknown)}")
        if "shown" in block.words:
            if not block.words["shown"]:
                raise Failed("a block that is only shown needs a reason")
            self.counts["shown"] += 1
            self.left_out = True
            return False
        self.left_out = False
        needs = block.words.get("needs")
        missing = needs and not self.options.hosts and not (needs in ("package", "grainlearning") and self.options.package)
        missing = missing or (needs == "grainlearning" and importlib.util.find_spec(needs) is None)
        if missing or ("slow" in block.words and not self.options.slow):
            if block.language == "python":
                compile(block.text, str(self.path), "exec")
            self.counts["left out"] += 1
            self.left_out = True
            return False
        getattr(self, block.language)(block)
        self.counts["run"] += 1
        return True

    def command(self, arguments, status=0, needs=None, **more):
        environment = dict(self.environment)
        if needs == "lammps":
            # It has an mpirun of its own, which is not that of LIGGGHTS.
            environment["PATH"] = os.pathsep.join([str(ROOT / ".venv-lammps/bin"), environment["PATH"]])
        done = subprocess.run(
            arguments, cwd=self.folder, env=environment, timeout=LIMIT, text=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **more,
        )
        if done.returncode != status:
            raise Failed(f"status {done.returncode} where {status} is expected:\n{done.stdout[-4000:]}")

    def sh(self, block):
        self.command(["bash", "-euo", "pipefail", "-c", block.text], int(block.words.get("fails", 0)), block.words.get("needs"))

    def python(self, block):
        if "file" in block.words:
            (self.folder / block.words["file"]).write_text(block.text, encoding="utf-8")
            return
        if block.words.get("needs") == "yade":
            (self.folder / "script.py").write_text(block.text, encoding="utf-8")
            self.command(["yade", "-nx", "script.py"])
            return
        text = io.StringIO()
        # exec in a page's own process: see main().
        os.chdir(self.folder)
        try:
            with contextlib.redirect_stdout(text):
                exec(compile("\n" * block.line + block.text, str(self.path), "exec"), self.names)
        except BaseException:
            raise Failed(f"{text.getvalue()[-2000:]}{traceback.format_exc(limit=-2)}") from None

    def toml(self, block):
        try:
            tables = tomllib.loads(block.text)
        except tomllib.TOMLDecodeError as error:
            raise Failed(f"no TOML: {error}") from None
        if "fragment" in block.words:
            self.fragment(tables, block.words["fragment"])
            return
        self.number += 1
        name = block.words.get("file", f"block-{self.number}.toml")
        (self.folder / name).write_text(block.text, encoding="utf-8")
        if "axis" in tables or "scenario" in tables:
            return  # a sweep: the block that runs it follows
        if "version" not in tables:
            raise Failed("neither a whole scenario nor marked as a fragment")
        self.command(["concordem", "check", "--no-build", name])

    def fragment(self, tables, base):
        import jsonschema
        import tomli_w

        for error in jsonschema.Draft202012Validator(relaxed(self.options.schema)).iter_errors(tables):
            best = jsonschema.exceptions.best_match([error])
            raise Failed(f"{'.'.join(map(str, best.absolute_path))}: {best.message}")
        if base:
            self.command(["concordem", "init", "--force", "--template", base, "base.toml"])
            whole = tomllib.loads((self.folder / "base.toml").read_text(encoding="utf-8"))
            for key, value in tables.items():
                # Materials of the fragment that the template has, too, extend it.
                if key == "material":
                    old = {one["name"]: one for one in whole["material"]}
                    value = list({**old, **{one["name"]: {**old.get(one["name"], {}), **one} for one in value}}.values())
                whole[key] = value
            (self.folder / "fragment.toml").write_text(tomli_w.dumps(whole), encoding="utf-8")
            self.command(["concordem", "check", "--no-build", "fragment.toml"])


def one_page(options):
    """Run one page in this process; its counts go to standard output as JSON."""
    with tempfile.TemporaryDirectory(prefix="book-") as folder:
        page = Page(options.pages[0].resolve(), options, folder)
        try:
            counts = page.run()
        except Failed as error:
            print(error, file=sys.stderr)
            return 1
        finally:
            os.chdir("/")
    print(json.dumps(counts))
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="*", type=Path, help="pages; by default all of the book")
    parser.add_argument("--hosts", action="store_true", help="also what needs YADE, LIGGGHTS, LAMMPS, or the Python package")
    parser.add_argument("--package", action="store_true", help="also what needs the Python package, which this Python has, and no host")
    parser.add_argument("--slow", action="store_true", help="also what takes minutes")
    parser.add_argument("--verbose", action="store_true", help="print the time of every block")
    parser.add_argument("--concordem", type=Path, default=ROOT / "target/release/concordem", help="the program")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    options.concordem = options.concordem.resolve()
    if not options.concordem.is_file():
        raise SystemExit(f"{options.concordem} is missing; run cargo build --release -p concordem")
    if options.one:
        options.schema = json.loads(subprocess.run([options.concordem, "schema"], check=True, capture_output=True).stdout)
        return one_page(options)

    pages = options.pages or [ROOT / "README.md", *sorted(page for page in BOOK.rglob("*.md") if "_build" not in page.parts and "generated" not in page.parts)]
    pages = [page for page in pages if blocks_of(page)]
    flags = [flag for flag in ("hosts", "package", "slow", "verbose") if getattr(options, flag)]
    totals, failures = {}, []

    def run(page):
        command = [sys.executable, __file__, "--one", "--concordem", options.concordem, *(f"--{flag}" for flag in flags), page]
        return page, subprocess.run(command, text=True, capture_output=True)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for page, done in pool.map(run, pages):
            *text, counts = done.stdout.splitlines() or [""]
            if options.verbose and text:
                print("\n".join(text))
            if done.returncode:
                failures.append(done.stderr.strip())
                print(f"FAILED {done.stderr.strip()}", file=sys.stderr)
                continue
            for name, count in json.loads(counts).items():
                totals[name] = totals.get(name, 0) + count
    print(f"{len(pages)} pages with code: " + ", ".join(f"{count} blocks {name}" for name, count in totals.items()))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
