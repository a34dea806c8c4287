#!/usr/bin/env python3
"""Mutation run: do the tests notice wrong physics?

`mutants.toml` lists mistakes. This program puts all of them into one copy of the tree, each behind a switch, builds that
copy once, and runs its tests once per mutant, with the number of the mutant in the environment. A mutant is killed by the
first test that fails, that ends abnormally, or that takes far longer than without it; it survives if all tests pass.

    tests/mutants/run.py --check            does every mutant apply, and is it Rust? Seconds; compiles nothing
    tests/mutants/run.py                    all mutants; an hour or two. Stop it at any time: it goes on there
    tests/mutants/run.py --own           only with the tests of the package that holds the mutant: a second per mutant; survivors stay to run
    tests/mutants/run.py --area law --only ID --limit 10
    tests/mutants/run.py --report           write result.json from what is known; runs no mutant

It works in target/mutants/, and keeps what it finds there in state.jsonl: one line per mutant. A killed mutant is not run
again as long as its source file, its definition, and the name of the test that killed it are the same; a survivor passes again
all tests whose binary has changed. Tests of hosts, of YADE, and of the harness take no part; neither does the fuzz tool.

result.json has the last outcome of each mutant, with the commit at which it was found. A run replaces the outcomes of the mutants
that it runs; the others stay as long as their definition does. The test recorded there is the first that a mutant meets.
"""

import argparse
import concurrent.futures
import hashlib
import json
import os
import platform
import re
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "validation"))
from concordem_validate import provenance

# Cargo names files without links.
WORK = (ROOT / "target" / "mutants").resolve()
TREE = WORK / "tree"
BUILD = WORK / "build"
LIST = Path(__file__).with_name("mutants.toml")
RESULT = Path(__file__).with_name("result.json")

AREAS = "law kinematics integration damping ledger time-step walls forces operator scenario statics neighbor packing heat continuum sweep".split()
KEYS = {"id", "area", "file", "original", "mutated", "breaks", "within", "survives"}

# The package of each folder below rust-core/. All of them use the first one.
PACKAGES = {
    "contact": "concordem-contact",
    "operator": "concordem-operator",
    "continuum": "concordem-continuum",
    "solver": "concordem-solver",
    "packing": "concordem-packing",
    "statics": "concordem-statics",
    "files": "concordem-files",
    "scenario": "concordem-scenario",
    "multiscale": "concordem-multiscale",
    "app": "concordem",
}
WITHOUT = {"fuzz"}
# The packages that are compiled: those with tests, and one that makes all dependencies have the features that they have in
# `make test`, so that what that compiled is used here.
SELECTED = [*PACKAGES.values(), "concordem-tests", "concordem-module"]

# A mutant survives less than one time in twenty.
WANTED = 0.95
# Tests that take less than this many seconds are run first.
QUICK = 0.3
# A test that takes this many times as long as without a mutant hangs; the machine may be busy.
PATIENCE = 8.0
GRACE = 60.0
MEMORY = 8 << 30

SWITCH = """//! Which mutant is active: its number is in the environment, and is read once.

use std::sync::atomic::{AtomicU32, Ordering};

const UNREAD: u32 = u32::MAX;
static ACTIVE: AtomicU32 = AtomicU32::new(UNREAD);

/// Whether this mutant is active.
#[inline(always)]
pub fn active(number: u32) -> bool {
    let now = ACTIVE.load(Ordering::Relaxed);
    now == number || (now == UNREAD && read() == number)
}

#[cold]
#[inline(never)]
fn read() -> u32 {
    let number = std::env::var("CONCORDEM_MUTANT").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
    ACTIVE.store(number, Ordering::Relaxed);
    number
}
"""


class Fault(Exception):
    """What stops the program."""


# ---- The list, and the copy of the tree -------------------------------------------------------------------------------


def read_list():
    mutants = tomllib.loads(LIST.read_text())["mutant"]
    for number, mutant in enumerate(mutants, 1):
        mutant["number"] = number
        unknown = set(mutant) - KEYS - {"number"}
        missing = {"id", "area", "file", "original", "mutated", "breaks"} - set(mutant)
        if unknown or missing:
            raise Fault(f"mutant {mutant.get('id', number)}: unknown keys {sorted(unknown)}, missing {sorted(missing)}")
        if mutant["area"] not in AREAS:
            raise Fault(f"mutant {mutant['id']}: area {mutant['area']} is none of {', '.join(AREAS)}")
        if mutant["mutated"].strip() == mutant["original"].strip():
            raise Fault(f"mutant {mutant['id']} changes nothing")
    names = [mutant["id"] for mutant in mutants]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise Fault(f"mutants with the same id: {', '.join(twice)}")
    return mutants


def find_once(text, part, what):
    count = text.count(part)
    if count != 1:
        raise Fault(f"{what} occurs {count} times instead of once: {part!r}")
    return text.index(part)


def span(mutant, text):
    """Where the mutant's original stands."""
    start, name = 0, f"mutant {mutant['id']}: in {mutant['file']}"
    if "within" in mutant:
        start = find_once(text, mutant["within"], f"{name} `within`")
        text = mutant["within"]
    found = find_once(text, mutant["original"], f"{name} `original`")
    end = found + len(mutant["original"])
    if re.match(r"\s*let\b", mutant["original"]):
        raise Fault(f"{name} `original` declares a name, which would end with the choice between it and the mutant; write its value alone")
    if text[end:end + 1] in (".", "?") and re.search(r" [-+*/] ", re.sub(r"\(.*\)", "", mutant["original"])):
        raise Fault(f"{name} `original` is no operand: {text[end:end + 12]!r} belongs to its last part only")
    return start + found, start + end


def choose(active, mutants, original):
    """Code that is one of the mutants, or the original."""
    is_statement = mutants[0]["original"].rstrip().endswith(";")
    block = (lambda text: f"{{ {text} }}") if is_statement else (lambda text: f"{{ ({text}) }}")
    code = "".join(f"if {active}({mutant['number']}) {block(mutant['mutated'])} else " for mutant in mutants)
    code += block(original)
    return code if is_statement else f"({code})"


def splice(text, start, end, spans, active):
    """`text[start:end]` with the mutants of `spans`, a sorted list of ((start, end), mutants); they may lie in each other."""
    parts, place = [], start
    while spans:
        (first, last), mutants = spans[0]
        inner = [other for other in spans[1:] if other[0][0] < last]
        if last > end or any(other[0][1] > last for other in inner):
            raise Fault(f"mutant {mutants[0]['id']} overlaps another one in part")
        parts += [text[place:first], choose(active, mutants, splice(text, first, last, inner, active))]
        place, spans = last, spans[1 + len(inner) :]
    return "".join(parts) + text[place:end]


def mutated_sources(mutants):
    """The files that hold mutants, with all of them; by path."""
    by_file = {}
    for mutant in mutants:
        by_file.setdefault(mutant["file"], []).append(mutant)
    sources = {}
    for file, inside in by_file.items():
        package = file.split("/")[0]
        if package not in PACKAGES:
            raise Fault(f"mutant {inside[0]['id']}: {file} lies in none of {', '.join(PACKAGES)}")
        text = (ROOT / "rust-core" / file).read_text()
        spans = {}
        for mutant in inside:
            spans.setdefault(span(mutant, text), []).append(mutant)
        active = "crate::mutants::active" if package == "contact" else "concordem_contact::mutants::active"
        ordered = sorted(spans.items(), key=lambda entry: (entry[0][0], -entry[0][1]))
        sources[f"rust-core/{file}"] = splice(text, 0, len(text), ordered, active)
    return sources


def parse(sources):
    """Fail if a mutated source is not Rust. One such mutant keeps all others from running; types are checked when they are built."""

    def parsed(path):
        command = ["rustfmt", "--edition", "2024", "--emit", "stdout"]
        return path, subprocess.run(command, input=sources[path], capture_output=True, text=True, check=False)

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        wrong = [f"{path}: {done.stderr.strip()}" for path, done in pool.map(parsed, sources) if "error: " in done.stderr]
    if wrong:
        raise Fault("mutants that are not Rust\n" + "\n".join(wrong))


def tracked_files():
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True, capture_output=True
    ).stdout.decode()
    return [name for name in listed.split("\0") if name and (ROOT / name).is_file() and not name.startswith("tests/mutants/")]


def write_tree(mutants):
    """Copy the tree with all mutants; files that are the same stay, so that little is compiled again."""
    sources = {name: text.encode() for name, text in mutated_sources(mutants).items()}
    library = "rust-core/contact/src/lib.rs"
    sources[library] = (ROOT / library).read_bytes() + b"\n#[doc(hidden)]\npub mod mutants;\n"
    sources["rust-core/contact/src/mutants.rs"] = SWITCH.encode()
    names = set(tracked_files()) | set(sources)
    for name in names:
        data = sources.get(name) or (ROOT / name).read_bytes()
        target = TREE / name
        if not target.is_file() or target.read_bytes() != data:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
            if (ROOT / name).exists():
                shutil.copymode(ROOT / name, target)
    for path in TREE.rglob("*"):
        if path.is_file() and str(path.relative_to(TREE)) not in names:
            path.unlink()


# ---- The tests --------------------------------------------------------------------------------------------------------


def build():
    """Compile the tests of the copy; returns them as {name, executable, folder, package}, those of libraries first."""
    if not BUILD.exists() and (ROOT / "target" / "release").exists():
        # Dependencies that are compiled already. What does not fit is compiled again.
        shutil.copytree(ROOT / "target" / "release", BUILD / "release", symlinks=True)
    print("compiling all mutants at once", flush=True)
    selection = [argument for package in SELECTED for argument in ("-p", package)]
    command = ["cargo", "test", "--release", *selection, "--tests", "--no-run", "--message-format=json-render-diagnostics"]
    with open(WORK / "build.log", "w") as log:
        done = subprocess.run(command, cwd=TREE, env=environment(0), stdout=subprocess.PIPE, stderr=log, text=True, check=False)
    if done.returncode != 0:
        raise Fault(f"the mutants do not compile: see {WORK / 'build.log'}")
    binaries = []
    for line in done.stdout.splitlines():
        message = json.loads(line)
        if message["reason"] != "compiler-artifact" or not message.get("executable") or not message["profile"]["test"]:
            continue
        target, folder = message["target"], Path(message["manifest_path"]).parent
        package = next((p for p in PACKAGES if folder == TREE / "rust-core" / p), "tests")
        is_library = "lib" in target["kind"]
        if "bin" in target["kind"] or "example" in target["kind"] or target["name"] in WITHOUT:
            continue
        name = f"{package}/{'unit' if is_library else target['name']}"
        binaries.append({"name": name, "executable": message["executable"], "folder": str(folder), "package": package})
    order = [*PACKAGES, "tests"]
    return sorted(binaries, key=lambda b: (order.index(b["package"]), not b["name"].endswith("/unit"), b["name"]))


def environment(number):
    """One thread per process, and nothing that lets a test write into the tree."""
    return os.environ | {
        "CARGO_TARGET_DIR": str(BUILD),
        "CONCORDEM_MUTANT": str(number),
        "CONCORDEM_COMMIT": "mutants",
        "INSTA_UPDATE": "no",
        "INSTA_WORKSPACE_ROOT": str(TREE),
        "RAYON_NUM_THREADS": "1",
    }


LINE = re.compile(r"^test (\S+)(?: - should panic)? \.\.\. (ok|FAILED|ignored)")


def run_tests(binary, names, number, limit):
    """Run tests of a binary one after the other, until one fails. Returns what failed or None, and the seconds by test."""

    def prepare():
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    arguments = ["--test-threads=1"] if names is None else ["--test-threads=1", "--exact", *names]
    env = environment(number) | {"CARGO_MANIFEST_DIR": binary["folder"]}
    process = subprocess.Popen(
        [binary["executable"], *arguments],
        cwd=binary["folder"],
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        errors="replace",
        start_new_session=True,
        preexec_fn=prepare,
    )
    late = threading.Event()

    def end():
        late.set()
        os.killpg(process.pid, signal.SIGKILL)

    timer = threading.Timer(limit, end) if limit else None
    if timer:
        timer.start()
    seconds, before, failed = {}, time.monotonic(), None
    for line in process.stdout:
        if found := LINE.match(line):
            now = time.monotonic()
            name, outcome = found.groups()
            if outcome == "FAILED":
                failed = name
                break
            if outcome == "ok":
                seconds[name] = now - before
            before = now
    if timer:
        timer.cancel()
    if failed:
        os.killpg(process.pid, signal.SIGKILL)
    process.stdout.close()
    status = process.wait()
    if failed:
        return f"{binary['name']}: {failed}", seconds
    if late.is_set():
        return f"{binary['name']}: time-out", seconds
    if status != 0:
        return f"{binary['name']}: ended with status {status}", seconds
    return None, seconds


class Suite:
    """The test binaries, and how long each test takes without a mutant, found out when it is first asked for."""

    def __init__(self, binaries):
        self.binaries = binaries
        self.file = WORK / "baseline.json"
        self.known = json.loads(self.file.read_text()) if self.file.exists() else {}
        self.locks = {binary["name"]: threading.Lock() for binary in binaries}
        self.writing = threading.Lock()
        for binary in binaries:
            binary["hash"] = hashlib.sha256(Path(binary["executable"]).read_bytes()).hexdigest()[:16]

    def seconds(self, binary):
        """Seconds of each test of a binary without a mutant; all tests must pass."""
        with self.locks[binary["name"]]:
            entry = self.known.get(binary["name"], {})
            if entry.get("hash") == binary["hash"]:
                return entry["seconds"]
            failure, seconds = run_tests(binary, None, 0, None)
            if failure:
                raise Fault(f"a test fails without a mutant: {failure}")
            with self.writing:
                self.known[binary["name"]] = {"hash": binary["hash"], "seconds": seconds}
                self.file.write_text(json.dumps(self.known, indent=1))
            print(f"           {sum(seconds.values()):7.1f} s  {binary['name']} without a mutant", flush=True)
            return seconds

    def has(self, name, test):
        return test in self.known.get(name, {}).get("seconds", {})


def kill(mutant, suite, old, own_only=False):
    """Run the tests with a mutant until one fails; returns which or None, and the hash of each binary that passes.

    First the test that killed it last, then the quick tests of its package and of all others, then the slow ones. Binaries that are
    the same as when it survived are not run again. `own_only`: only the tests of its package.
    """
    package, passed = mutant["file"].split("/")[0], dict(old.get("passed", {}))
    todo = [binary for binary in suite.binaries if passed.get(binary["name"]) != binary["hash"]]
    own = [binary for binary in todo if binary["package"] == package]
    # Tests of behavior notice more than the unit tests of other packages.
    others = sorted((b for b in todo if b["package"] != package), key=lambda binary: binary["package"] != "tests")
    if own_only:
        todo, others = own, []

    def run(binary, tests):
        seconds = suite.seconds(binary)
        limit = GRACE + PATIENCE * sum(seconds[test] for test in tests)
        return run_tests(binary, tests, mutant["number"], limit)[0] if tests else None

    def tests_of(binary, quick):
        return [test for test, seconds in suite.seconds(binary).items() if (seconds < QUICK) == quick]

    if ": " in (old.get("killer") or ""):
        name, test = old["killer"].split(": ", 1)
        for binary in todo:
            if binary["name"] == name and test in suite.seconds(binary) and (killer := run(binary, [test])):
                return killer, {}
    for binary in own + others:
        if killer := run(binary, tests_of(binary, True)):
            return killer, {}
    slow = [(suite.seconds(binary)[test], binary["name"], test, binary) for binary in todo for test in tests_of(binary, False)]
    for _, _, test, binary in sorted(slow, key=lambda entry: (entry[3]["package"] != package, entry[:3])):
        if killer := run(binary, [test]):
            return killer, {}
    return None, {binary["name"]: binary["hash"] for binary in suite.binaries}


# ---- What is known ----------------------------------------------------------------------------------------------------


def fingerprint(mutant):
    """Changes with the mutant and with its source file."""
    source = (ROOT / "rust-core" / mutant["file"]).read_text().split("#[cfg(test)]")[0]
    definition = [mutant[key] for key in ("file", "original", "mutated")] + [mutant.get("within")]
    return hashlib.sha256((source + json.dumps(definition)).encode()).hexdigest()[:16]


def read_state():
    file = WORK / "state.jsonl"
    lines = file.read_text().splitlines() if file.exists() else []
    return {record["id"]: record for record in map(json.loads, lines)}


def is_current(record, mutant, suite):
    """Whether a mutant need not run again."""
    if record is None or record["fingerprint"] != fingerprint(mutant):
        return False
    if record["killer"] is None:
        return record["passed"] == {binary["name"]: binary["hash"] for binary in suite.binaries}
    binary, test = record["killer"].split(": ", 1)
    abnormal = test == "time-out" or test.startswith("ended with")
    return abnormal or suite.has(binary, test)


def machine():
    compiler = subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=True).stdout.split()
    return {"processor": provenance.processor(), "cores": os.cpu_count(), "system": platform.system(), "rustc": compiler[1]}


def git(*arguments):
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def definition(mutant):
    """Changes with the mutant, and not with the rest of its source file."""
    parts = [mutant[key] for key in ("file", "original", "mutated")] + [mutant.get("within")]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:12]


def read_outcomes(mutants):
    """What result.json says about the mutants whose definition has not changed since."""
    recorded = json.loads(RESULT.read_text()).get("outcomes", {}) if RESULT.exists() else {}
    entries = {mutant["id"]: recorded.get(mutant["id"]) for mutant in mutants}
    return {m["id"]: entries[m["id"]] for m in mutants if entries[m["id"]] and entries[m["id"]]["definition"] == definition(m)}


def report(mutants, suite):
    """Write result.json: outcomes of this tree, and those of earlier commits for mutants that were not run here.

    Returns whether enough mutants are killed, none survives without a reason, and all were run.
    """
    state = read_state()
    changes = git("status", "--porcelain", "--untracked-files=no", "--", "rust-core", "tests", ":!tests/mutants/result.json")
    commit = git("rev-parse", "--short", "HEAD") + ("+changes" if changes else "")
    outcomes = read_outcomes(mutants)
    for mutant in mutants:
        record = state.get(mutant["id"])
        if is_current(record, mutant, suite):
            outcomes[mutant["id"]] = {"killer": record["killer"], "commit": commit, "definition": definition(mutant)}
    killed = {name for name, outcome in outcomes.items() if outcome["killer"]}
    survived = [m for m in mutants if m["id"] in outcomes and m["id"] not in killed]
    by_area = {area: [sum(m["id"] in killed for m in mutants if m["area"] == area),
                      sum(m["area"] == area for m in mutants)] for area in AREAS}
    killers = {}
    for name in killed:
        binary = outcomes[name]["killer"].split(": ")[0]
        killers[binary] = killers.get(binary, 0) + 1
    result = {
        "commit": commit,
        "date": time.strftime("%Y-%m-%d", time.gmtime()),
        "machine": machine(),
        "mutants": len(mutants),
        "run": len(outcomes),
        "killed": len(killed),
        "killed_fraction": round(len(killed) / len(mutants), 4),
        "killed_of_all_by_area": by_area,
        "killed_by": dict(sorted(killers.items(), key=lambda entry: -entry[1])),
        "survived": {m["id"]: m.get("survives", f"no test notices it: {m['breaks']}") for m in survived},
        "not_run": [m["id"] for m in mutants if m["id"] not in outcomes],
        "outcomes": dict(sorted(outcomes.items())),
    }
    RESULT.write_text(json.dumps(result, indent=1) + "\n")
    print(f"{len(killed)} of {len(mutants)} mutants killed ({100 * result['killed_fraction']:.1f} %), "
          f"{len(result['not_run'])} not run; see {RESULT.relative_to(ROOT)}")
    for mutant in survived:
        print(f"  survived: {mutant['id']} ({mutant['area']}): {mutant['breaks']}")
    return len(killed) >= WANTED * len(mutants) and all("survives" in m for m in survived) and not result["not_run"]


# ---- The run ----------------------------------------------------------------------------------------------------------


def run(mutants, selected, suite, arguments):
    state = read_state()
    # On another machine, the test that killed a mutant last is run first.
    hints = {name: {"killer": outcome["killer"]} for name, outcome in read_outcomes(mutants).items()}
    todo = [m for m in selected if arguments.again or not is_current(state.get(m["id"]), m, suite)]
    print(f"{len(selected) - len(todo)} mutants are known, {len(todo)} to run", flush=True)
    lock, done = threading.Lock(), 0

    def one(mutant):
        nonlocal done
        old = state.get(mutant["id"]) or hints.get(mutant["id"], {})
        if arguments.again or old.get("fingerprint") != fingerprint(mutant):
            old = {"killer": old.get("killer")}
        started = time.monotonic()
        killer, passed = kill(mutant, suite, old, arguments.own)
        if killer is None and arguments.own:
            with lock:
                done += 1
                print(f"{done:4}/{len(todo)} passes the tests of its package: {mutant['id']}", flush=True)
            return
        seconds = round(time.monotonic() - started + (old.get("seconds", 0) if old.get("passed") else 0), 1)
        record = {"id": mutant["id"], "fingerprint": fingerprint(mutant), "killer": killer, "seconds": seconds, "passed": passed}
        with lock, open(WORK / "state.jsonl", "a") as file:
            file.write(json.dumps(record) + "\n")
            done += 1
            print(f"{done:4}/{len(todo)} {seconds:7.1f} s  {mutant['id']:40} {killer or 'SURVIVED'}", flush=True)

    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        try:
            for future in concurrent.futures.as_completed([pool.submit(one, mutant) for mutant in todo[: arguments.limit]]):
                future.result()
        except BaseException:
            pool.shutdown(cancel_futures=True, wait=False)
            raise


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only look whether every mutant applies and is Rust")
    parser.add_argument("--report", action="store_true", help="only build, and write result.json from what is known")
    parser.add_argument("--only", action="append", metavar="ID", help="run these mutants; may be repeated")
    parser.add_argument("--area", action="append", choices=AREAS, help="run the mutants of these areas; may be repeated")
    parser.add_argument("--limit", type=int, metavar="N", help="run N mutants at most")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="mutants at the same time (2)")
    parser.add_argument("--own", action="store_true", help="only tests of the package of the mutant; survivors stay to run")
    parser.add_argument("--again", action="store_true", help="also run mutants whose outcome is known")
    arguments = parser.parse_args()
    try:
        mutants = read_list()
        unknown = set(arguments.only or ()) - {mutant["id"] for mutant in mutants}
        if unknown:
            raise Fault(f"no such mutants: {', '.join(sorted(unknown))}")
        sources = mutated_sources(mutants)
        if arguments.check:
            parse(sources)
            print(f"{len(mutants)} mutants apply to {len(sources)} files")
            return 0
        selected = [m for m in mutants if (not arguments.only or m["id"] in arguments.only)
                    and (not arguments.area or m["area"] in arguments.area)]
        WORK.mkdir(parents=True, exist_ok=True)
        write_tree(mutants)
        suite = Suite(build())
        if not arguments.report:
            run(mutants, selected, suite, arguments)
        return 0 if report(mutants, suite) else 1
    except Fault as fault:
        print(f"mutants: {fault}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
