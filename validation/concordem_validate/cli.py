"""Command line of the harness."""
import argparse
import math
import os
import sys
from pathlib import Path

from . import baseline, compare, difference, history, lint, merging, mutate, outputs, project, quirks, registry, report, rounds, runner, starter
from . import case as cases
from .errors import HarnessError, NotInstalled
from .result import Result

_CODES = ("Exit codes: 0: all checks are within tolerance; 1: a check failed or could not be made; 2: wrong arguments or an unreadable case; "
          "3: a required engine is missing or computed nothing (those of `require` in validate.toml; all with --strict, or with CI and without "
          "validate.toml); 5: nothing was checked, or a merged round lacks cases.")


# as a shell tells a program that SIGPIPE has ended
_PIPE_CLOSED = 141


def _number(text, least, kind=float):
    try:
        value = kind(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value >= least):
        raise argparse.ArgumentTypeError(f"{text!r} is no {'whole ' if kind is int else 'finite '}number from {least:g}")
    return value


def _tolerance(text):
    return _number(text, 0.0)


def _factor(text):
    return _number(text, 1e-3)


def _count(text):
    return _number(text, 1, int)


def _parser():
    parser = argparse.ArgumentParser(
        prog="concordem-validate", description="Run the same scenarios in several codes and compare the results.", epilog=_CODES)
    parser.add_argument("--version", action="version", version=f"concordem-validate {starter.version()}")
    commands = parser.add_subparsers(dest="command", required=True)

    def command(name, text, *, round_=False, pick=False):
        one = commands.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".", epilog=_CODES)
        one.add_argument("--config", type=Path, help="file of engines and cases; default: validate.toml here")
        one.add_argument("--cases", dest="folders", action="append", default=[], metavar="DIR", help="folder of cases; may be repeated")
        if pick:
            one.add_argument("cases", nargs="*", help="names of cases; default: all fast ones")
            one.add_argument("--full", action="store_true", help="all cases, including the long ones")
        if round_:
            one.add_argument("--output", type=Path, help="folder of results and report")
            one.add_argument("--strict", action="store_true", help="a missing engine is an error (default without validate.toml if CI is set)")
            one.add_argument("--verbose", action="store_true", help="print every check, including those that pass")
            one.add_argument("--junit", type=Path, metavar="FILE", help="also write JUnit XML")
            one.add_argument("--json", type=Path, metavar="FILE", help="also write the record of the round as JSON")
            one.add_argument("--badge", type=Path, metavar="FILE", help="also write a badge as SVG")
            one.add_argument("--against", metavar="NAME", help="also compare every result with this baseline")
            one.add_argument("--tolerance", type=_tolerance, default=0.0, help="largest relative difference from the baseline (default: 0, the same bits)")
            one.add_argument("--store", type=Path, default=Path("baselines"), help="folder of baselines (default: %(default)s)")
        return one

    one = command("list", "list cases and engines")
    one.add_argument("--checks", action="store_true", help="also list every check with its tolerance and reason")
    one = command("run", "run cases, compare the results, and write the report", round_=True, pick=True)
    one.add_argument("--fresh", action="store_true", help="repeat runs that are finished already")
    one.add_argument("--jobs", type=_count, help="number of engines at a time; default: one per processor")
    one.add_argument("--time-factor", type=_factor, default=1.0, help="multiplies all time limits, for slow machines")
    one.add_argument("--engines", help="only these engines beside the reference, separated by commas")
    one.add_argument("--reference", help="compare this engine with all others, in place of the case's reference")
    one.add_argument("--pairs", action="store_true", help="compare all engines of a check with each other")
    one.add_argument("--shard", metavar="K/N", help="only the K-th of N parts of the cases, for several machines")
    one.add_argument("--failed", action="store_true", help="only cases that failed in the last round")
    command("report", "write the report of the last round again; starts no engine", round_=True)
    one = command("merge", "merge rounds of several machines, and write the report", round_=True)
    one.add_argument("rounds", nargs="+", type=Path)
    one = command("bless", "store the results of the last round as a baseline")
    one.add_argument("name")
    one.add_argument("--output", type=Path, help="folder of the round")
    one.add_argument("--store", type=Path, default=Path("baselines"), help="folder of baselines (default: %(default)s)")
    one = command("diff", "say what differs between two rounds or baselines, and what changed")
    one.add_argument("a", type=Path)
    one.add_argument("b", type=Path)
    one = command("history", "write a page with a curve for each check over several rounds")
    one.add_argument("rounds", nargs="+", type=Path, help="folders of rounds, or with a round.json each")
    one.add_argument("--page", type=Path, default=Path("history.html"), help="page to write (default: %(default)s)")
    one = command("compare", "compare the series of two result files (HDF5 or CSV), or all results of two rounds bit by bit (two folders)")
    one.add_argument("a", type=Path)
    one.add_argument("b", type=Path)
    one.add_argument("--tolerance", type=_tolerance, default=0.0, help="largest allowed relative difference (default: %(default)g)")
    one.add_argument("--over", default="time", help="axis: time, step, or a series (default: %(default)s)")
    one.add_argument("--interpolate", action="store_true", help="interpolate the finer curve at the points of the coarser one")
    command("lint", "find checks that cannot fail, and cases without effect; uses the results of the last round, if there are any",
            pick=True).add_argument("--output", type=Path, help="folder of the round")
    one = command("mutate", "plant mistakes in what an engine gets, and list those that no check sees", pick=True)
    one.add_argument("--engine", required=True, help="the engine that gets them")
    one.add_argument("--output", type=Path, help="folder of results")
    one = command("init", "write a case, an engine, and workflow files for GitHub and GitLab; in a project, only the workflow files that are missing")
    one.add_argument("folder", type=Path)
    return parser


def main(arguments=None):
    options = _parser().parse_args(arguments)
    try:
        code = globals()[f"_{options.command}"](options)
        sys.stdout.flush()
        return code
    except BrokenPipeError:
        # `head` has what it wants; what is left in the buffer goes nowhere
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _PIPE_CLOSED
    except HarnessError as error:
        print(f"concordem-validate: {error}", file=sys.stderr)
        return rounds.WRONG_INPUT
    except OSError as error:
        print(f"concordem-validate: {error}; mend the path, or its rights", file=sys.stderr)
        return rounds.WRONG_INPUT
    except KeyboardInterrupt:
        print("interrupted; finished runs are kept, repeat the command to continue", file=sys.stderr)
        return 130


def _project(options):
    made = project.load(options.config, options.folders)
    if getattr(options, "output", None):
        made.output = options.output
    if made.output.exists() and not made.output.is_dir():
        raise HarnessError(f"{made.output} is no folder; give another `output`")
    for name in ("junit", "json", "badge"):
        if getattr(options, name, None):
            for engine in registry.ENGINES.values():
                getattr(engine, "written", set()).add(getattr(options, name).absolute())
    return made


def _load(options, made):
    wanted = options.cases or list(dict.fromkeys(name for root in made.roots for name in cases.names(root)))
    if not wanted:
        raise HarnessError(f"{made.roots[0]} has no folder with a case.toml; add one, or give --cases")
    loaded = [cases.find(name, made.roots) for name in wanted]
    return loaded if options.cases or options.full else [c for c in loaded if c.tier == "fast"]


def _list(options):
    made = _project(options)
    for name, engine in registry.ENGINES.items():
        try:
            print(f"engine {name:14} {engine.version()}")
        except NotInstalled as error:
            print(f"engine {name:14} {error}")
    for root in made.roots:
        for name in cases.names(root):
            one = cases.load(name, root)
            print(f"{name:28} {one.tier:5} {len(one.tasks):3} variants, {', '.join(one.engines)}: {one.title}")
            for check in one.checks if options.checks else []:
                limit = f"known {check.known} ({check.quirk})" if check.quirk else check.allowed
                print(f"    {check.name} | {check.peer} | {limit} | {check.reason.strip()}")
    return rounds.AGREES


def _strict(options, made):
    """Whether a missing engine is an error: with CI for our own cases; in a project of a user only those that it requires are."""
    return options.strict or made.path is None and runner.strict_by_default()


def _named(names):
    for name in names:
        if not registry.know(name):
            raise HarnessError(f"unknown engine `{name}`; valid engines are {', '.join(registry.ENGINES)}")
    return names


def _chosen(options, made):
    """The cases of a round, with its reference and engines, the engines that cases do not name, and the names of the cases of all parts."""
    loaded = _load(options, made)
    if options.failed:
        bad = {v["case"] for v in rounds.record(made.output)["verdicts"] if v["status"] == "fail"}
        loaded = [c for c in loaded if c.name in bad]
    wanted = [c.name for c in loaded]
    if options.shard:
        part, _, count = options.shard.partition("/")
        if not (part.isdigit() and count.isdigit() and 1 <= int(part) <= int(count)):
            raise HarnessError(f"--shard is {options.shard}; give K/N, such as 1/4")
        loaded = loaded[int(part) - 1::int(count)]
    reference = options.reference or made.reference
    added = set()
    if reference:
        _named([reference])
        added = {reference}
        loaded = [c.with_reference(reference) for c in loaded]
    if options.pairs:
        loaded = [c.all_pairs() for c in loaded]
    if options.engines:
        few = _named(options.engines.split(","))
        loaded = [c.only([t.variant for t in c.tasks], [*few, c.reference]) for c in loaded]
    for case in loaded:
        for text in lint.same_programs(case):
            raise HarnessError(f"case {case.name}: {text}; compare two codes")
    return loaded, added, wanted


def _run(options):
    made = _project(options)
    loaded, added, wanted = _chosen(options, made)
    strict = _strict(options, made)
    one = runner.Runner(made.output, options.jobs, options.fresh, time_factor=options.time_factor)
    round_ = one.run(loaded, added=added)
    round_.shard, round_.wanted = options.shard, wanted
    part = options.shard or options.cases or options.failed or options.engines
    round_.lacking = [name for name in made.require if name not in _computed(round_) and not (part and _installed(name))]
    return _finish(options, made, loaded, round_, strict)


def _computed(round_):
    return {o.engine for o in round_.outcomes.values() if o.status == "done"}


def _installed(name):
    try:
        registry.ENGINES[name].version()
    except HarnessError:
        return False
    return True


def _finish(options, made, loaded, round_, strict):
    """Compare with a baseline, write all outputs, and say what happened."""
    if options.against:
        round_.changes = baseline.against(round_, options.store / options.against, options.tolerance, few=bool(options.engines))
    code = round_.exit_code(strict, made.require)
    known = {name: q for root in made.roots for name, q in quirks.load_all(root).items() if _seen(name, q, loaded)}
    record = rounds.write(made.output, round_, code)
    path = report.write(made.output / "report.html", loaded, round_, known)
    print(report.text(loaded, round_, strict, options.verbose))
    for place, text in ((options.junit, outputs.junit(round_)), (options.json, record.read_text()), (options.badge, outputs.badge(round_, code))):
        if place:
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(text)
    if code == rounds.NOTHING_CHECKED:
        absent = round_.absent()
        print(f"CASES ARE MISSING: {', '.join(absent)}; merge all parts" if absent else "NOTHING WAS CHECKED: no check had both of its engines")
    if code == rounds.ENGINE_MISSING:
        print(f"A REQUIRED ENGINE COMPUTED NOTHING: {', '.join(round_.lacking)}; install it, let a case use it, or mend `require`" if round_.lacking
              else "A REQUIRED ENGINE IS MISSING: install it, or run without --strict and CI")
    if round_.shard and not round_.outcomes:
        print(f"part {round_.shard} has no case")
    print(f"report: {path}")
    return code


def _seen(name, quirk, loaded):
    """Whether a quirk belongs to one of the cases of a round."""
    return any(case.name in quirk["cases"] or any(check.quirk == name for check in case.checks) for case in loaded)


def _again(options, made, round_, starts):
    """Verdicts from stored results."""
    names = list(dict.fromkeys(case for case, _, _ in round_.outcomes))
    loaded = [cases.find(name, made.roots) for name in names]
    there = lambda case: {(v, e) for c, v, e in round_.outcomes if c == case.name}
    loaded = [c.only({v for v, _ in there(c)}, {e for _, e in there(c)}) for c in loaded]
    for case in loaded:
        runner.refuse_stale(case, round_.outcomes)
        round_.verdicts += compare.judge(case, round_.outcomes, times=round_.times)
    round_.starts = [outputs.start_verdict(one) for one in starts]
    return _finish(options, made, loaded, round_, _strict(options, made))


def _report(options):
    made = _project(options)
    return _again(options, made, rounds.again(made.output), rounds.record(made.output)["starts"])


def _merge(options):
    made = _project(options)
    round_, starts = merging.merge(options.rounds, made.output)
    round_.lacking = [name for name in made.require if name not in _computed(round_)]
    return _again(options, made, round_, starts)


def _bless(options):
    made = _project(options)
    path, count = baseline.bless(made.output, options.store / options.name)
    print(f"{count} results stored in {path}")
    return rounds.AGREES


def _history(options):
    print(f"history: {history.write(options.page, options.rounds)}")
    return rounds.AGREES


def _diff(options):
    lines, good = difference.folders(options.a, options.b)
    print("\n".join(lines))
    return rounds.AGREES if good else rounds.FAILED


def _compare(options):
    for path in (options.a, options.b):
        if not path.exists():
            raise HarnessError(f"{path} does not exist; check the path")
    if options.a.samefile(options.b):
        raise HarnessError(f"{options.a} and {options.b} are the same file, which always agrees with itself; give two")
    if options.a.is_dir() or options.b.is_dir():
        return _diff(options)
    a, b = Result.read(options.a), Result.read(options.b)
    lines, good = difference.files(a, b, options.tolerance, over=options.over, meet="interpolate" if options.interpolate else "common",
                                   names=(options.a.name, options.b.name) if options.a.name != options.b.name else (str(options.a), str(options.b)))
    print("\n".join(lines))
    return rounds.AGREES if good else rounds.FAILED


def _lint(options):
    made = _project(options)
    found = lint.find(_load(options, made), made.output)
    print("\n".join(found) if found else "no check was found that cannot fail")
    return rounds.FAILED if found else rounds.AGREES


def _mutate(options):
    made = _project(options)
    engine = _named([options.engine])[0]
    unseen, count, planted, idle = [], 0, set(), set()
    for case in _load(options, made):
        peers = [c.peer if c.reference == engine else c.reference for c in case.checks if engine in c.pair]
        few = case.only([t.variant for t in case.tasks], {engine, *peers})
        if not few.checks:
            continue
        hidden, seen, nothing = mutate.survivors(few, engine, lambda: runner.Runner(made.output, quiet=True))
        unseen += [f"{case.name}: no check sees {label}" for label in hidden]
        count += len(hidden) + len(seen)
        planted.update(hidden, seen)
        idle.update(nothing)
    if not count:
        raise HarnessError(f"no case compares `{engine}`")
    nowhere = [f"no case can show {label}: there it is zero or missing" for label in sorted(idle - planted)]
    print("\n".join([*unseen, *nowhere, f"{count - len(unseen)} of {count} mistakes are seen"]))
    return rounds.FAILED if unseen else rounds.AGREES


def _init(options):
    print("\n".join(starter.write(options.folder)))
    return rounds.AGREES
