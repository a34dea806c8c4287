#!/usr/bin/env python3
"""Speed of ConcorDEM beside YADE, LIGGGHTS, and LAMMPS: same packing, contacts, steps, and threads; equal physics is checked.

    validation/speed.py [--quick] [--rounds N] [--only CASE ...] [--again]    (make bench)
    validation/speed.py --docs | --check

Programs run in turn, in alternating order; a ratio is the median over rounds. One thread: processor time, because others may use the
machine; several threads: wall time, so nothing else should run. Finished cases are kept in target/bench and not repeated for the
same commit unless `--again`. After each case, writes validation/results/speed.json, the tables in docs/performance.md,
docs/book/evidence/speed.md, and README.md (between marks), and docs/book/images/speed.png, the picture only when all cases are on record. `--quick`: small
inputs, writes target/bench/quick.json only. `--docs`: writes pages and picture from the record. `--check`: fails if the pages do not show it.
"""
import argparse
import json
import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from concordem_bench import cases, inputs, measure, programs, report
from concordem_validate import provenance

ROOT = inputs.ROOT
WORK = ROOT / "target/bench"
RESULTS = ROOT / "validation/results/speed.json"
PAGES = [ROOT / "docs/performance.md", ROOT / "docs/book/evidence/speed.md", ROOT / "README.md"]
IMAGE = ROOT / "docs/book/images/speed.png"


def machine():
    """Processor and operating system, without the name of the machine."""
    return f"{provenance.processor()}, {os.cpu_count()} processors"


def save(path, record):
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(".tmp")
    temporary.write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n")
    temporary.replace(path)


def run(arguments):
    WORK.mkdir(parents=True, exist_ok=True)
    path = WORK / ("quick.json" if arguments.quick else "full.json")
    commit = provenance.label(inputs.PROGRAM)
    record = json.loads(path.read_text()) if path.exists() and not arguments.again else {}
    if record.get("commit") != commit or record.get("rounds") != arguments.rounds:
        record = {"commit": commit, "machine": machine(), "date": time.strftime("%Y-%m-%d", time.gmtime()), "rounds": arguments.rounds,
                  "seconds": 0, "load_average": [os.getloadavg()[0]] * 2, "cases": {}}
    known = cases.all_cases(WORK, arguments.quick)
    unknown = set(arguments.only or []) - set(known)
    if unknown:
        sys.exit(f"no case {', '.join(sorted(unknown))}; there are {', '.join(known)}")
    for name in arguments.only or known:
        if name in record["cases"] and not arguments.only:
            continue
        began = time.monotonic()
        # Before and after, because the machine may be shared: the larger one counts.
        before = programs.memory()
        found = measure.run(known[name], arguments.rounds, lambda text: print(text, flush=True))
        after = programs.memory()
        fastest = {key: max(before[key], after[key], record.get("memory", before)[key]) for key in before}
        record["memory"] = fastest
        record["cases"][name] = found
        record["seconds"] += round(time.monotonic() - began)
        record["load_average"][1] = os.getloadavg()[0]
        record["cases"] = {name: record["cases"][name] for name in known if name in record["cases"]}
        record["missing"] = [name for name in known if name not in record["cases"]]
        save(path, record)
        if not arguments.quick:
            save(RESULTS, record)
            if not record["missing"]:
                write_docs(record)
    print("\n".join(report.table(record)))


def write_docs(record):
    for page in PAGES:
        page.write_text(report.insert(page.read_text(), record))
    report.plot(record, IMAGE)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small inputs and few steps")
    parser.add_argument("--rounds", type=int, help="5, or 1 with --quick")
    parser.add_argument("--only", nargs="+", metavar="CASE")
    parser.add_argument("--again", action="store_true", help="forget finished cases")
    parser.add_argument("--docs", action="store_true", help="write the record into the pages")
    parser.add_argument("--check", action="store_true", help="fail if the pages do not show the record")
    arguments = parser.parse_args()
    arguments.rounds = arguments.rounds or (1 if arguments.quick else 5)
    if arguments.docs or arguments.check:
        record = json.loads(RESULTS.read_text())
        if arguments.docs:
            write_docs(record)
        for page in PAGES:
            if page.read_text() != report.insert(page.read_text(), record):
                sys.exit(f"{page.relative_to(ROOT)} does not show validation/results/speed.json; run validation/speed.py --docs")
        return
    run(arguments)


if __name__ == "__main__":
    main()
