#!/usr/bin/env python3
"""Instructions per contact and step, counted by valgrind, compared with those on record: a guard against slower steps.

    validation/instructions.py [--full] [--record]

Counts do not depend on what else the machine does. Each law runs 1,160 spheres (a bed: 1,000) on one thread, twice with different numbers of steps; the
difference is that of the steps alone. valgrind has no AVX-512, so the count is that of the loops for AVX2. Without `--full`: concrete
alone. `--record` writes validation/results/instructions.json and the table in docs/book/evidence/speed.md.
"""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from concordem_bench import inputs

SPEED = inputs.ROOT / "target/release/examples/speed"
RESULTS = inputs.ROOT / "validation/results/instructions.json"
PAGE = inputs.ROOT / "docs/book/evidence/speed.md"
BEGIN, END = "<!-- instructions.py: counts -->", "<!-- end of counts -->"
#: No change may slow a step by more than 2 % without a reason (CONTRIBUTING.md). Counts repeat to 1e-4: threads of the pool look for
#: work at times that differ.
TOLERANCE = 0.02
#: Another compiler chooses other instructions.
TOLERANCE_OTHER_COMPILER = 0.15
FEW, MANY = 10, 40
TENSION = ["--rate", "0.05"]
#: Damage grows in most bonds: each step strains the specimen by some 2e-6, and cracks begin at 1e-4.
DAMAGE = ["--rate", "20", "--warmup", "60"]
#: Overlapping spheres that are shaken: all contacts touch, a part of them slides.
BED = ["--shake", "0.01", "--young", "5e7", "--density", "2500", "--time-step", "1e-7"]
SCENARIOS = {
    "cpm": ["cpm", *TENSION],
    "cpm, damage grows": ["cpm", *DAMAGE],
    "cpm, law and kinematics of YADE": ["cpm-yade", "--kinematics", "yade-ratcheting", *TENSION],
    "cohesive_beam": ["cohesive_beam", *TENSION],
    "linear_bond": ["linear_bond", *TENSION],
    "linear_bond, deformable particles": ["deformable", *TENSION],
    "hertz_mindlin, periodic": ["hertz_mindlin", *BED],
}
REDUCED = ["cpm"]


def compiler():
    return subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=True).stdout.strip()


def run(words, steps):
    """Instructions of a run, and its contacts."""
    with tempfile.TemporaryDirectory() as folder:
        packing = inputs.lattice(Path(folder), 10, 0.0099, 0.005, periodic=True) if words[1:] == BED else inputs.GOLD
        done = subprocess.run(
            ["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/out", str(SPEED), str(packing), *words,
             "--steps", str(steps)],
            capture_output=True, text=True, env={**os.environ, "RAYON_NUM_THREADS": "1"})
    if done.returncode:
        sys.exit(f"instructions.py: valgrind failed:\n{done.stderr[-2000:]}")
    return int(re.search(r"Collected : (\d+)", done.stderr)[1]), json.loads(done.stdout)["contacts"]


def per_contact_step(words):
    """Instructions per contact and step."""
    with ThreadPoolExecutor(2) as pool:
        (few, contacts), (many, same) = pool.map(lambda steps: run(words, steps), (FEW, MANY))
    assert contacts == same
    return (many - few) / ((MANY - FEW) * contacts)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="all laws")
    parser.add_argument("--record", action="store_true", help="write the counts of all laws to the record")
    arguments = parser.parse_args()
    known = json.loads(RESULTS.read_text()) if RESULTS.exists() else {"counts": {}, "compiler": None}
    names = list(SCENARIOS) if arguments.full or arguments.record else REDUCED
    counts = {}
    for name in names:
        counts[name] = round(per_contact_step(SCENARIOS[name]), 2)
        before = known["counts"].get(name)
        change = f", {counts[name] / before - 1:+.2%} of the record" if before else ""
        print(f"{name:36} {counts[name]:7.1f} instructions per contact and step{change}", flush=True)
    if arguments.record:
        RESULTS.write_text(json.dumps({"compiler": compiler(), "steps": [FEW, MANY], "counts": counts}, indent=1) + "\n")
        PAGE.write_text(insert(PAGE.read_text()))
        return
    wrong = problems(counts, known, compiler())
    if wrong:
        sys.exit("instructions.py: " + "\n".join(wrong))


def insert(page):
    """The text of a page with the table of the record between the marks."""
    record = json.loads(RESULTS.read_text())
    head, rest = page.split(BEGIN, 1)
    _, tail = rest.split(END, 1)
    lines = [f"{record['compiler']}:", "", "| Contacts | Instructions per contact and step |", "|---|---|"]
    lines += [f"| {name} | {count:.0f} |" for name, count in record["counts"].items()]
    return "\n".join([head + BEGIN, *lines, END + tail])


def problems(counts, known, compiler):
    """What differs from the record by more than the tolerance. Fewer instructions must be recorded, too, or the guard gets lax."""
    tolerance = TOLERANCE if compiler == known["compiler"] else TOLERANCE_OTHER_COMPILER
    found = []
    for name, count in counts.items():
        before = known["counts"].get(name)
        if before is None:
            found.append(f"{name} is not on record; run validation/instructions.py --record")
        elif abs(count / before - 1) > tolerance:
            found.append(f"{name}: {count:.1f} instructions per contact and step, on record {before:.1f}, more than {tolerance:.0%} apart. "
                         "If the change is meant, run validation/instructions.py --record and give the reason in docs/journal/speed.md.")
    return found


if __name__ == "__main__":
    main()
