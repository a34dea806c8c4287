"""Finds what cannot fail: checks that see nothing, engines that are the same program, cases that check nothing."""
from pathlib import Path

from . import compare, registry, rounds
from .errors import HarnessError


def find(cases, output=None):
    """Lines about the cases, and about the stored results of the last round if there are any."""
    out = []
    for case in cases:
        out += [f"{case.name}: {text}" for text in _case(case)]
    if output and (Path(output) / rounds.RECORD).exists():
        found = rounds.outcomes(output)
        for case in cases:
            if any(key[0] == case.name for key in found):
                out += [f"{v.case} · {v.variant} · {v.check.name} · {v.peer}: {v.message}" for v in compare.judge(case, found, times=rounds.times(output)) if v.cause == "blind"]
    return out


def _case(case):
    compared = {engine for check in case.checks for engine in check.pair}
    compared |= {f"{check.reference}@twin" for check in case.checks if check.twin}
    for variant, engines in case.engines_of.items():
        for engine in engines:
            if engine.endswith("@twin") and engine in compared:
                continue
            if engine not in compared or not any(variant in case.variants_of(c) and engine in c.pair for c in case.checks):
                yield f"variant {variant} runs {engine}, but no check compares it; add one, or leave the engine out"
    seen = {}
    for check in case.checks:
        key = (check.name, *check.pair, check.of, check.norm, check.over, tuple(check.variants))
        if key in seen:
            yield f"check `{check.name}` with {check.peer} is there twice; remove one"
        seen[key] = check
    yield from same_programs(case)


def same_programs(case):
    """Two engines that are one program agree always."""
    found = {}
    for name in dict.fromkeys([case.reference, *case.engines]):
        same_as = getattr(registry.ENGINES[name], "same_as", None)
        if same_as is None:
            continue
        try:
            key = same_as()
        except (HarnessError, OSError):
            continue
        if key in found:
            yield f"engines {found[key]} and {name} are the same program, so they agree always"
        found[key] = name
