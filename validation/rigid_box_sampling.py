#!/usr/bin/env python3
"""The rigid box of ERDC TR-14-6 Report 3, section 5.2: three sphere sizes in two boxes, sampled while its lid comes down.

    validation/rigid_box_sampling.py [--full]

Each case is one run of `examples/rigid_box_sampling.rs`. Results go to validation/results/rigid_box_sampling.json, case by
case, so that an interrupted study goes on where it stopped. Without --full one case with a tenth of its spheres runs, and
its result goes to no file.
"""

import argparse
import json
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/examples/rigid_box_sampling"
RESULTS = ROOT / "validation/results/rigid_box_sampling.json"


def run(*arguments):
    command = [PROGRAM, *map(str, arguments)]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="all cases with the printed numbers of spheres; hours")
    arguments = parser.parse_args()
    build = ["cargo", "build", "--release", "-p", "concordem", "--example", "rigid_box_sampling"]
    subprocess.run(build, check=True, cwd=ROOT)
    if not arguments.full:
        print(json.dumps(run(1, 1, 10), indent=1))
        return
    results = json.loads(RESULTS.read_text())
    known = {(case["case"], case["geometry"]) for case in results["cases"]}
    for case in [(size, box) for box in (1, 2) for size in (1, 2, 3)]:
        if case in known:
            continue
        results["cases"].append(run(*case))
        temporary = RESULTS.with_suffix(".tmp")
        temporary.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n")
        temporary.replace(RESULTS)
        print(f"size {case[0]}, box {case[1]}: done", flush=True)


if __name__ == "__main__":
    main()
