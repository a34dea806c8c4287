#!/usr/bin/env python3
"""Runs hundreds of random scripts (test_random_scripts.py, test_random_cohesive.py, test_random_jointed.py) against stock YADE and keeps what they did in many_scripts.json.

    run.sh many [GOAL]           up to script GOAL (500) of each kind; continues where the file ends
    run.sh many GOAL --seed N    GOAL scripts of each kind from number N on, without the file (nightly); fails if one does

A script that fails is kept with its message; delete its entry to run it again.
"""

import argparse
import ast
import collections
import json
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
FILE = HERE / "many_scripts.json"
KINDS = {"cohesive": "test_random_cohesive.py", "concrete": "test_random_scripts.py", "jointed": "test_random_jointed.py"}
#: Scripts in one process; a test run of more also asks whether the scripts do enough.
AT_ONCE = 19


def played(test, first, count):
    """The output of some scripts; empty if one failed, and then its message."""
    environment = dict(os.environ, CONCORDEM_SEED=str(first), CONCORDEM_SCRIPTS=str(count), OMP_WAIT_POLICY="passive")
    done = subprocess.run(["yade", "-n", "-x", "-j1", test], cwd=HERE, env=environment, capture_output=True, text=True, timeout=3600, check=False)
    out = done.stdout + done.stderr
    if "ALL TESTS PASSED" in out:
        return out, ""
    messages = [line for line in out.splitlines() if "Error: " in line]
    return "", messages[-1] if messages else f"ended with {done.returncode}: {out[-300:]}"


def counts(out, word):
    return collections.Counter(ast.literal_eval(next(line for line in out.splitlines() if line.startswith(word + " "))[len(word) + 1 :]))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("goal", type=int, nargs="?", default=500)
    parser.add_argument("--seed", type=int)
    wanted = parser.parse_args()
    kept = json.loads(FILE.read_text()) if FILE.exists() and wanted.seed is None else {}
    before = (wanted.seed or 1) - 1
    for kind, test in KINDS.items():
        row = kept.setdefault(kind, {"scripts": 0, "followed": {}, "refused": {}, "sensitive": 0, "failed": {}})
        while row["scripts"] < wanted.goal:
            first, count = before + row["scripts"] + 1, min(AT_ONCE, wanted.goal - row["scripts"])
            out, _ = played(test, first, count)
            for number in [first] if out else range(first, first + count):
                if not out:
                    alone, message = played(test, number, 1)
                    if message:
                        row["failed"][str(number)] = message
                        continue
                text = out or alone
                for word in ("followed", "refused"):
                    row[word] = dict(sorted((collections.Counter(row[word]) + counts(text, word)).items()))
                row["sensitive"] += text.count(", one bit in stock YADE makes")
            row["scripts"] += count
            if wanted.seed is None:
                FILE.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n")
            print(kind, row["scripts"], "failed:", row["failed"], flush=True)
    sys.exit(any(row["failed"] for row in kept.values()))


main()
