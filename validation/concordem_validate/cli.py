"""Command line of the harness."""
import argparse
import sys
from pathlib import Path

from . import case as cases
from . import compare, report, runner
from .engines import ENGINES
from .errors import HarnessError, NotInstalled
from .result import Result

_OUT = Path(__file__).parents[2] / "target" / "validate"


def main(arguments=None):
    parser = argparse.ArgumentParser(
        prog="concordem-validate", description="Run the same scenarios in several codes and compare the results.",
        epilog="Exit codes: 0: all checks are within tolerance; 1: a check failed or could not be made (with CI or --strict also: a peer "
               "is missing); 2: wrong arguments or an unreadable case.")
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("list", help="list cases and engines")
    one.add_argument("--checks", action="store_true", help="also list every check with its tolerance and reason")
    one = commands.add_parser("run", help="run cases, compare the results, and write the report")
    one.add_argument("cases", nargs="*", help="names of cases; default: all fast ones")
    one.add_argument("--full", action="store_true", help="run all cases, including the long ones")
    one.add_argument("--strict", action="store_true", help="a missing peer is a failure (default if CI is set)")
    one.add_argument("--fresh", action="store_true", help="repeat runs that are finished already")
    one.add_argument("--verbose", action="store_true", help="print every check, including those that pass")
    one.add_argument("--jobs", type=int, help="number of engines at a time; default: one per processor")
    one.add_argument("--time-factor", type=float, default=1.0, help="multiplies all time limits, for slow machines")
    one.add_argument("--output", type=Path, default=_OUT, help="folder of results and report (default: %(default)s)")
    one = commands.add_parser(
        "compare", help="compare the series of two result files, or ConcorDEM's results of two rounds bit by bit (two folders of "
                        "`run --output`)")
    one.add_argument("a", type=Path)
    one.add_argument("b", type=Path)
    one.add_argument("--tolerance", type=float, default=0.0, help="largest allowed relative difference (default: %(default)g)")
    one = commands.add_parser("report", help="write the report from finished runs; run only what is missing")
    one.add_argument("cases", nargs="*")
    one.add_argument("--full", action="store_true")
    one.add_argument("--output", type=Path, default=_OUT)
    options = parser.parse_args(arguments)
    try:
        return globals()[f"_{options.command}"](options)
    except HarnessError as error:
        print(f"concordem-validate: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted; finished runs are kept, repeat the command to continue", file=sys.stderr)
        return 130


def _load(options):
    wanted = options.cases or cases.names()
    loaded = [cases.load(name) for name in wanted]
    return loaded if options.cases or options.full else [c for c in loaded if c.tier == "fast"]


def _list(options):
    for name, engine in ENGINES.items():
        try:
            print(f"engine {name:14} {engine.version()}")
        except NotInstalled as error:
            print(f"engine {name:14} {error}")
    for name in cases.names():
        one = cases.load(name)
        print(f"{name:28} {one.tier:5} {len(one.tasks):3} variants, {', '.join(one.engines)}: {one.title}")
        if options.checks:
            for check in one.checks:
                limit = f"known {check.known} ({check.quirk})" if check.quirk else f"≤ {check.tolerance:g}"
                print(f"    {check.name} | {check.peer} | {limit} | {check.reason}")
    return 0


def _run(options):
    loaded = _load(options)
    made = runner.Runner(options.output, options.jobs, options.fresh, time_factor=options.time_factor)
    round_ = made.run(loaded)
    path = report.write(options.output / "report.html", loaded, round_)
    strict = options.strict or runner.strict_by_default()
    print(report.text(loaded, round_, strict, options.verbose))
    print(f"report: {path}")
    return 1 if round_.failed(strict) else 0


def _report(options):
    options.jobs, options.fresh, options.time_factor, options.strict, options.verbose = None, False, 1.0, False, False
    return _run(options)


def _compare(options):
    for path in (options.a, options.b):
        if not path.exists():
            raise HarnessError(f"{path} does not exist; check the path")
    if options.a.is_dir() or options.b.is_dir():
        lines, good = compare.rounds(options.a, options.b)
        print("\n".join(lines))
        return 0 if good else 1
    lines, good = compare.files(Result.read(options.a), Result.read(options.b), options.tolerance)
    print("\n".join(lines))
    return 0 if good else 1
