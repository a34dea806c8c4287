"""Command line of a long study: a reduced case by default, all cases with `--full`, resumable."""

import argparse
import json
import os
import shutil
import sys
import tempfile

from . import provenance


def run(file, description, program, results, *, full, reduced, check_reduced, check_record, table,
        picture=None):
    """Run the study in `file` with the executable `program`; `results` is its record, a JSON file.

    `full` and `reduced` are called with `(known, save, about, program, options)`: they add the missing cases to the dictionary `known`, with
    the entries of `about`, and call `save()` after each; `options` are options of `concordem run`. `check_reduced(found, known)` and
    `check_record(known)` return messages about what is wrong, `table(known)` prints the record; `picture(path, program)` draws.
    """
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("--full", action="store_true", help="all cases at full size; resumable")
    parser.add_argument("--table", action="store_true", help="the figures on record as tables, and nothing else")
    if picture:
        parser.add_argument("--picture", metavar="FILE", help="a picture of some cases, computed again, and nothing else")
    parser.add_argument("--threads", type=int, help="threads of a run; the results are those of any number")
    arguments = parser.parse_args()
    options = ["-j", str(arguments.threads)] if arguments.threads else []
    known = json.loads(results.read_text())["cases"] if results.exists() else {}
    if arguments.table:
        table(known)
        return
    if picture and arguments.picture:
        picture(arguments.picture, program)
        return

    def save():
        temporary = results.with_suffix(".tmp")
        temporary.write_text(json.dumps({"cases": known}, indent=1, ensure_ascii=False) + "\n")
        temporary.replace(results)

    wrong = []
    if arguments.full:
        with tempfile.TemporaryDirectory() as keep:
            # A copy, so that one build computes all cases.
            copy = shutil.copy(program, keep)
            about = {"commit": provenance.label(copy), "machine": f"{provenance.processor()}, {os.cpu_count()} processors"}
            reduced(known, save, about, copy, options)
            full(known, save, about, copy, options)
    else:
        found = {}
        reduced(found, lambda: None, {}, program, options)
        wrong += check_reduced(found, known)
    wrong += check_record(known)
    sys.exit(f"{os.path.basename(file)}: " + "\n".join(wrong) if wrong else 0)
