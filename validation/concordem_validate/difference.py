"""What differs between two results, files, or rounds: in which quantity, by how much, first at which step and particle, and why."""
import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from . import meeting, norms, rounds
from .errors import HarnessError, Incomparable
from .quantity import factor
from .result import Result

# Two codes that sum in another order differ by some last bits; more is another computation.
_ROUNDING_ULP = 4


def _timeless(value):
    """Numbers without timings."""
    if isinstance(value, dict):
        return {k: _timeless(v) for k, v in value.items() if not (k in ("wall_s", "particle_steps_per_s") or k.endswith("_seconds"))}
    return [_timeless(v) for v in value] if isinstance(value, list) else value


def _alike(u, v):
    return u.dtype == v.dtype and u.shape == v.shape and u.tobytes() == v.tobytes()


def same_bits(a, b):
    """Bitwise differences between two results, without timings; empty if there are none."""
    found = []
    for kind in ("series", "fields"):
        x, y = getattr(a, kind), getattr(b, kind)
        found += [f"{kind}/{name} is in one only" for name in sorted(x.keys() ^ y.keys())]
        for name in sorted(x.keys() & y.keys()):
            if kind == "fields":
                found += [] if _alike(x[name][0], y[name][0]) else [f"{kind}/{name} differs"]
            elif not (_alike(x[name].steps, y[name].steps) and _alike(x[name].values, y[name].values)
                      and _alike(a.time(name), b.time(name))):
                found.append(f"{kind}/{name} differs{_first(a, b, name)}")
    # JSON contains all digits
    if len({json.dumps(_timeless(r.numbers), sort_keys=True) for r in (a, b)}) > 1:
        found.append("numbers differ")
    if not (a.dt == b.dt or math.isnan(a.dt) and math.isnan(b.dt)) or a.provenance.get("state_hash") != b.provenance.get("state_hash"):
        found.append("the time step or the final state hash differs")
    return found


def _first(a, b, name):
    """Size of a difference and where it begins."""
    x, y = a.series[name], b.series[name]
    if not np.array_equal(x.steps, y.steps):
        return f": {len(x.steps)} samples up to step {x.steps[-1] if len(x.steps) else 'none'}, " \
               f"{len(y.steps)} up to {y.steps[-1] if len(y.steps) else 'none'}"
    if x.values.shape != y.values.shape:
        return f": shapes {x.values.shape[1:]} and {y.values.shape[1:]}"
    if not np.array_equal(a.time(name), b.time(name)):
        return ": at other times"
    unlike = (x.values != y.values) & ~(np.isnan(x.values) & np.isnan(y.values))
    flat = unlike.reshape(len(x.steps), -1)
    if not flat.any():
        return ": in the sign of a zero or of a NaN"
    k = int(np.flatnonzero(flat.any(axis=1))[0])
    off = np.abs(x.values - y.values)
    particle = f", particle {int(np.flatnonzero(unlike[k].reshape(x.values.shape[1], -1).any(axis=1))[0])}" if x.values.ndim > 2 else ""
    with np.errstate(all="ignore"):
        ulp = np.nanmax(off / np.spacing(np.maximum(np.abs(x.values), np.abs(y.values))))
        relative = np.nanmax(off) / np.nanmax(np.abs(y.values))
    kind = "rounding" if ulp <= _ROUNDING_ULP else f"{relative:.2e} of the largest value"
    return f": {kind}, at most {np.nanmax(off):.3e} {x.unit}, first at step {x.steps[k]}{particle}"


def cause(a, b):
    """Which of engine, case, harness, and machine changed between two results, from their provenance."""
    names = (("engine_version", "engine"), ("case_hash", "case"), ("harness_hash", "harness"), ("start_hash", "start state"), ("host", "machine"),
             ("processor", "machine"))
    changed = {word: None for key, word in names if a.provenance.get(key) != b.provenance.get(key)}
    return "changed: " + ", ".join(changed) if changed else "engine, case, harness, and machine are the same"


def stored(folder):
    """Results in the output of a round, or in a baseline: (case, variant, engine) to path. Hashes in names do not count."""
    folder = Path(folder)
    runs = folder / "runs" if (folder / "runs").is_dir() else folder
    if (folder / rounds.RECORD).is_file():
        rows = rounds.record(folder)["outcomes"]
        return {(o["case"], o["variant"], o["engine"]): folder / o["path"] for o in rows if o["status"] == "done"}
    out = {}
    for path in sorted(runs.glob("*.h5"), key=lambda p: p.stat().st_mtime):
        about = Result.read(path)
        out[about.provenance.get("case", path.stem), about.provenance.get("variant", ""), about.engine] = path
    return out


def folders(a, b):
    """Lines about all results of two rounds or baselines, and whether all are bitwise equal."""
    x, y = stored(a), stored(b)
    if not x.keys() & y.keys():
        raise HarnessError(f"{a} and {b} have no common results; run two rounds with `run --output`")
    lines = [f"{' · '.join(key)} is in one round only" for key in sorted(x.keys() ^ y.keys())]
    for key in sorted(x.keys() & y.keys()):
        one, two = Result.read(x[key]), Result.read(y[key])
        found = same_bits(one, two)
        lines += [f"{' · '.join(key)}: {what}" for what in found] + ([f"    {cause(one, two)}"] if found else [])
    good = not lines
    return lines + [f"{len(x.keys() & y.keys())} results compared" + (", all bitwise equal" if good else "")], good


def _field(lines, name, ours, theirs, tolerance):
    """A line about a field that both have, and whether it is within the tolerance."""
    (x, unit), (y, other) = ours, theirs
    x, y = np.asarray(x), np.asarray(y)
    try:
        scale = factor(other, unit)
    except HarnessError as error:
        lines.append(f"{name:24} cannot be compared: {error}")
        return False
    if x.shape != y.shape or x.dtype.kind not in "biuf" or y.dtype.kind not in "biuf":
        same = x.shape == y.shape and np.array_equal(x, y)
        lines.extend([] if same else [f"{name:24} has shapes {x.shape} and {y.shape}, or is no number in one"])
        return same
    x, y = x.astype(float), y.astype(float) * scale
    off, size = float(np.abs(x - y).max(initial=0.0)), float(np.abs(y).max(initial=0.0))
    relative = off / size if size > 0 else off
    lines.append(f"{name:24} {off:.3e} {unit} of {size:.3e} {unit}: {relative:.2e}{'' if relative <= tolerance else '  beyond ' + format(tolerance, 'g')}")
    return relative <= tolerance


def files(a, b, tolerance, *, over="time", meet="common", names=("the first", "the second")):
    """Lines about all series of two results, and whether both have all series, whole, and within the tolerance."""
    lines, good, moving = [], bool(a.series.keys() & b.series.keys()), False
    if not good:
        lines.append("no common series")
    for name in sorted(a.fields.keys() & b.fields.keys()):
        good &= _field(lines, name, a.fields[name], b.fields[name], tolerance)
    if any("time_step" in r.provenance for r in (a, b)) and over == "time":
        over = "step"
    for name in sorted(a.series.keys() | b.series.keys()):
        if name not in a.series or name not in b.series:
            good = False
            lines.append(f"{name:24} is in {names[1] if name in b.series else names[0]} only")
            continue
        check = SimpleNamespace(name=name, of=name, over=over, meet=meet, first=None, last=None, from_step=0, to_step=None)
        try:
            pair = meeting.meet(check, a, b, names)
        except Incomparable as error:
            good = False
            lines.append(f"{name:24} cannot be compared: {error}")
            continue
        off, size = float(norms.sizes(pair.a - pair.b).max()), float(norms.sizes(pair.b).max())
        relative = off / size if size > 0 else off
        within = relative <= tolerance
        good &= within
        moving |= size > 0 or off > 0
        # results may have different intervals; report how many points are common
        counts = len(a.series[name].steps), len(b.series[name].steps)
        part = "" if len(pair.x) == counts[0] == counts[1] else f", at {len(pair.x)} common points of {counts[0]} and {counts[1]}"
        lines.append(f"{name:24} {off:.3e} {pair.unit} of {size:.3e} {pair.unit}: {relative:.2e}{part}"
                     f"{'' if within else '  beyond ' + format(tolerance, 'g')}")
    if good and not moving:
        lines.append("all series are zero in both, as in runs that do nothing, so nothing is compared")
    return lines, good and moving
