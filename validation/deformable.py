#!/usr/bin/env python3
"""Deformable particles (Madan 2019): stability of irregular packings of discs, waves, and spheres in space.

    validation/deformable.py [--full] [--only stability,solid,wave]

Each case is one run of `examples/deformable_study.rs` in the crate of the tests. Results are written to
validation/results/deformable.json after every case, so that an interrupted study continues where it stopped. Without --full, the
packings are small and no results are written.
"""

import argparse
import itertools
import json
import os
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from concordem_validate import provenance

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/examples/deformable_study"
RESULTS = ROOT / "validation/results/deformable.json"


def cases(full):
    discs, seed = ("4979" if full else "300"), "1"
    for poisson in ["0.05", "0.1", "0.15", "0.2", "0.25", "0.3", "0.35", "0.4", "0.45"]:
        yield ["stability", discs, seed, poisson]
    # Range of Poisson's ratio in three dimensions.
    solid = [("0", "0"), *itertools.product(["0.2", "0.5", "1"], ["-0.5", "0", "0.25", "0.49"])]
    packings = ["sc", "fcc", "random"] if full else ["sc", "fcc"]
    for packing, kappa, (softness, poisson) in itertools.product(packings, ["0", "0.5", "1"], solid):
        yield ["solid", packing, seed, kappa, softness, poisson]
    # The bar of the source, and one four times as long and wide, because bonds are missing at the free sides and ten discs across
    # are few.
    for size, kappa, (softness, poisson) in itertools.product(
        ["1", "4"] if full else ["1"], ["0.2", "0.5", "1"], [("0", "0"), ("0.18", "0.45"), ("0.35", "0.45")]
    ):
        yield ["wave", size, seed, kappa, softness, poisson]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="the packings of the source")
    parser.add_argument("--only", default="stability,solid,wave", help="kinds of cases")
    arguments = parser.parse_args()
    build = ["cargo", "build", "--release", "-p", "concordem-tests", "--example", "deformable_study"]
    subprocess.run(build, cwd=ROOT, check=True)
    commit = provenance.of_tree()
    results = json.loads(RESULTS.read_text()) if arguments.full and RESULTS.exists() else {}
    for case in cases(arguments.full):
        name = " ".join(case)
        if case[0] not in arguments.only.split(",") or name in results:
            continue
        run = subprocess.run([PROGRAM, *case], capture_output=True, text=True)
        if run.returncode:
            sys.exit(f"deformable.py: {name}: {run.stderr.strip()}")
        results[name] = json.loads(run.stdout) | {"commit": commit}
        print(f"{name}: {run.stdout.strip()}", flush=True)
        if arguments.full:
            RESULTS.parent.mkdir(exist_ok=True)
            part = RESULTS.with_suffix(".part")
            part.write_text(json.dumps(results, indent=1) + "\n")
            os.replace(part, RESULTS)


if __name__ == "__main__":
    main()
