"""The report: a self-contained HTML page, and a short version for the terminal."""
import base64
import io
import json
import math
import os
import platform
import re
from datetime import datetime, timezone
from pathlib import Path

import jinja2
import markupsafe
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

from . import compare  # noqa: E402
from .errors import HarnessError  # noqa: E402
from .process import plain  # noqa: E402

STUDIES = Path(__file__).parents[1] / "results"
_WORDS = {"pass": "agrees", "known": "known difference", "fail": "FAILS", "missing": "not installed", "skipped": "skipped", "none": ""}
_SHORT = {"pass": "agree", "known": "known", "fail": "FAIL", "missing": "not installed", "skipped": "skipped"}
_RANK = {"none": 0, "pass": 1, "known": 2, "skipped": 3, "missing": 3, "fail": 4}
_MOST_PLOTTED = 8
_MOST_CURVES = 6
_MARGINS = dict(left=0.16, right=0.97, top=0.91)


def _code(text):
    """HTML of a text; words in backticks become code."""
    return markupsafe.Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(markupsafe.escape(text))))


def _figure(figure, margins=None):
    """A figure as text of a page. With given margins it is drawn once, else twice, to find them."""
    data = io.BytesIO()
    if margins:
        figure.subplots_adjust(**margins)
    figure.savefig(data, format="png", dpi=100, bbox_inches=None if margins else "tight")
    plt.close(figure)
    return "data:image/png;base64," + base64.b64encode(data.getvalue()).decode()


def _limit(check):
    if check.kind == "baseline":
        return "the same bits" if not check.tolerance else f"≤ {check.tolerance:.1g}"
    return check.allowed


def _number(value):
    return "–" if value is None or math.isnan(value) else ("0" if value == 0 else f"{value:.2g}")


def difference_plot(verdicts):
    """Plot of the difference over the steps, on a logarithmic axis, with the limits of each check."""
    figure, axes = plt.subplots(figsize=(6.2, 2.9))
    for k, verdict in enumerate(verdicts[:_MOST_PLOTTED]):
        colour = f"C{k}"
        # draw zero differences at the last bit, because the axis is logarithmic
        # dashes show curves that coincide
        axes.plot(verdict.steps, np.maximum(verdict.growth, 1e-17), color=colour, lw=1.2, ls=("-", (0, (4, 2)), (0, (2, 2)), "-.")[k % 4],
                  label=f"{verdict.variant} · {verdict.peer}")
        check = verdict.check
        if check.known is not None:
            axes.axhspan(*check.known, color=colour, alpha=0.12, lw=0)
        else:
            axes.axhline(check.tolerance, color=colour, ls="--", lw=0.8)
    axes.set(yscale="log", xlabel=verdicts[0].axis, ylabel="difference / scale", title=verdicts[0].check.name)
    # a hundred small ticks of fifteen decades take most of the time
    axes.minorticks_off()
    axes.set_ylim(bottom=5e-18)
    axes.grid(alpha=0.3)
    axes.title.set_fontsize(9)
    axes.legend(fontsize=7, loc="best")
    return _figure(figure, {**_MARGINS, "bottom": 0.17})


def _shown(check, values, x, y):
    """Numbers and names of the curves that a picture has room for: those with the largest differences."""
    size = np.max(np.abs(y)) or 1.0
    some = np.flatnonzero(np.max(np.abs(y), axis=0) >= 1e-9 * size)
    largest = some[np.argsort(-np.max(np.abs(x - y), axis=0)[some], kind="stable")][:_MOST_CURVES]
    shape = values.shape[1:]
    axis = lambda c: "xyz"[c] if shape[-1] == 3 else str(c)
    name = {0: lambda c: check.of, 1: axis, 2: lambda c: f"{c // shape[-1]}.{axis(c % shape[-1])}"}.get(len(shape), str)
    return [(int(c), name(int(c))) for c in sorted(largest)]


def curves_plot(verdict, ours):
    """Plot of both curves, and below it of their difference with the tolerance band."""
    check = verdict.check
    x, y = (v.reshape(len(v), -1) for v in verdict.values)
    of = check.of
    if check.scale == "displacement":
        # particles stand far apart, beside which their motion is small
        x, y, of = x - y[0], y - y[0], f"change of {of}"
    unit = ours.series[check.of].unit
    figure, (top, low) = plt.subplots(2, 1, figsize=(6.2, 3.6), sharex=True, height_ratios=(2, 1))
    shown = _shown(check, verdict.values[1], x, y)
    for k, (c, name) in enumerate(shown):
        top.plot(verdict.steps, x[:, c], f"C{k}-", lw=1.6, alpha=0.7, label=name)
        top.plot(verdict.steps, y[:, c], "k--", lw=0.7)
        low.plot(verdict.steps, x[:, c] - y[:, c], f"C{k}-", lw=0.9)
    if len(shown) > 1:
        top.legend(fontsize=7, ncols=2, title=None if x.shape[1] <= _MOST_CURVES else f"the largest differences of {x.shape[1]}", title_fontsize=7)
    bound = (check.known[1] if check.known else check.tolerance) * compare.scale_of(check.scale, verdict.values[1])
    low.axhspan(-bound, bound, color="green", alpha=0.12, lw=0)
    top.set(ylabel=f"{of}\n{unit}", title=f"{check.name} · {verdict.variant}: {verdict.reference} (color), {verdict.peer} (dashed)")
    low.set(ylabel=f"difference\n{unit}", xlabel=verdict.axis)
    most = max(bound, float(np.max(np.abs(x - y))))
    low.set_ylim(-1.3 * most, 1.3 * most)
    for axes in (top, low):
        # short numbers, for which there is room
        axes.ticklabel_format(axis="y", scilimits=(-3, 4))
        axes.grid(alpha=0.3)
        axes.title.set_fontsize(9)
    return _figure(figure, {**_MARGINS, "bottom": 0.14})


def picture(results, task):
    """Specimens side by side at the last common snapshot, in side view, colored by damage or displacement."""
    shown = [(name, r) for name, r in results if "position" in r.series and r.series["position"].values.shape[1] >= 20]
    # skip single rows of particles
    if len(shown) < 2 or np.ptp(shown[0][1].series["position"].values[0][:, 2]) == 0:
        return None
    figure, all_axes = plt.subplots(1, len(shown), figsize=(2.6 * len(shown) + 1, 3.6), sharey=True)
    step = min(int(r.series["position"].steps[-1]) for _, r in shown)
    top = 0.0
    drawn = []
    for axes, (name, r) in zip(all_axes, shown):
        k = int(np.searchsorted(r.series["position"].steps, step))
        x = r.series["position"].values[k]
        if "damage_field" in r.series and "cpm" in (task.scenario.get("material") or [{}])[0]:
            colour, label = r.series["damage_field"].values[k], "damage"
        else:
            colour, label = np.linalg.norm(x - r.series["position"].values[0], axis=1) * 1e3, "displacement, mm"
        order = np.argsort(x[:, 1])
        dots = axes.scatter(x[order, 0] * 1e3, x[order, 2] * 1e3, c=colour[order], s=9, cmap="viridis", lw=0)
        drawn.append(dots)
        top = max(top, float(colour.max()))
        axes.set(aspect="equal", title=f"{name}, step {step}", xlabel="x, mm")
    all_axes[0].set_ylabel("z, mm")
    for dots in drawn:
        dots.set_clim(0, top or 1.0)
    figure.colorbar(drawn[-1], ax=all_axes, label=label, shrink=0.8)
    return _figure(figure)


def engines_of(cases):
    """The engines of a round, references first."""
    return list(dict.fromkeys([*(c.reference for c in cases), *(e for c in cases for v in c.engines_of.values() for e in v)]))


def _versions(round_, engines):
    """Versions as the runs recorded them; no engine is asked."""
    rows = []
    for name in engines:
        mine = [o for o in round_.outcomes.values() if o.engine == name]
        found = {o.provenance().get("engine_version", "") for o in mine if o.status == "done"}
        rows.append((name, ", ".join(sorted(found - {""})) or next((o.message for o in mine if o.message), "")))
    return rows


def _flat(value, prefix=""):
    """Numbers of a study, one per row; long lists are skipped."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _flat(item, f"{prefix}{' · ' if prefix else ''}{key}")
    elif isinstance(value, list):
        if value and all(isinstance(v, (int, float)) for v in value) and len(value) <= 6:
            yield prefix, ", ".join(f"{v:.6g}" for v in value)
        elif value and isinstance(value[0], dict):
            for k, item in enumerate(value):
                yield from _flat(item, f"{prefix} [{k}]")
    elif isinstance(value, bool) or isinstance(value, str):
        yield prefix, str(value)
    elif isinstance(value, (int, float)):
        yield prefix, f"{value:.6g}"


def studies(folder=STUDIES):
    """The committed results of the long studies."""
    return [(path.name, list(_flat(json.loads(path.read_text())))) for path in sorted(folder.glob("*.json"))]


def _results(outcomes):
    """Stored results that can be read; the others have a verdict."""
    out = {}
    for o in outcomes:
        if o.status == "done":
            try:
                out[o.variant, o.engine] = o.result()
            except HarnessError:
                continue
    return out


def _case(case, round_):
    verdicts = [v for v in round_.verdicts if v.case == case.name]
    outcomes = [o for o in round_.outcomes.values() if o.case == case.name]
    results = _results(outcomes)
    groups = {}
    for verdict in verdicts:
        if verdict.growth is not None:
            groups.setdefault((verdict.check.name, verdict.check.of), []).append(verdict)
    plots = [difference_plot(group) for group in groups.values()]
    # of each pair of a check the worst variant
    seen, curves = set(), []
    for verdict in sorted(verdicts, key=lambda v: -_RANK[v.status]):
        which = verdict.check.name, verdict.reference, verdict.peer
        if verdict.values is not None and verdict.growth is not None and which not in seen:
            seen.add(which)
            curves.append((f"{verdict.check.name}: {verdict.reference} and {verdict.peer}", curves_plot(verdict, results[verdict.variant, verdict.reference])))
    pictures = []
    for task in case.tasks[:2]:
        mine = [(e, r) for (v, e), r in results.items() if v == task.variant and e not in ("analytic", "table") and not e.endswith("-np2")][:3]
        drawn = picture(mine, task)
        if drawn:
            pictures.append((task.variant, drawn))
    speeds = [
        dict(variant=v, engine=e, particles=r.numbers.get("particles"), steps=r.numbers.get("steps"),
             wall=r.numbers.get("wall_s"), rate=r.numbers.get("particle_steps_per_s"))
        for (v, e), r in results.items() if r.numbers.get("particle_steps_per_s")]
    provenance = [dict(variant=v, engine=e, items=sorted(r.provenance.items())) for (v, e), r in results.items()]
    notes = (case.folder / "README.md")
    return dict(
        name=case.name, title=case.title, question=case.question.strip(), source=case.source, tier=case.tier,
        notes=notes.read_text() if notes.exists() else "",
        abouts=[(task.variant, task.about) for task in case.tasks if task.about],
        checks=[dict(
            name=check.name, peer=check.peer, limit=_limit(check), reason=check.reason.strip(), quirk=check.quirk,
            verdicts=[dict(variant=v.variant, status=v.status, word=_WORDS[v.status], difference=_number(v.difference),
                           message=v.message) for v in verdicts if v.check is check]) for check in case.checks],
        troubles=[dict(variant=o.variant, engine=o.engine, status=o.status, message=o.message)
                  for o in outcomes if o.status != "done"],
        plots=plots, curves=curves, pictures=pictures, speeds=speeds, provenance=provenance)


def matrix(cases, round_):
    """Worst verdict of each case and peer. The column of the reference shows whether it ran, bitwise equal on two threads."""
    rows, engines = [], engines_of(cases)
    for case in cases:
        cells = {}
        own = [o for o in round_.outcomes.values() if o.case == case.name and o.engine == case.reference]
        bad = [o.status for o in own if o.status != "done"]
        if bad:
            cells[case.reference] = ("missing" if bad[0] == "missing" else "fail", _WORDS.get(bad[0], bad[0]))
        else:
            equal = sum("state_hash_2_threads" in o.provenance() for o in own if o.status == "done")
            cells[case.reference] = ("pass", f"ran {len(own)}" + (", bitwise equal on 2 threads" if equal else ""))
        for engine in engines:
            mine = [v for v in round_.verdicts if v.case == case.name and v.peer == engine]
            if mine:
                counts = {word: sum(v.status == word for v in mine) for word in ("fail", "missing", "skipped", "known", "pass")}
                worst = next(word for word, number in counts.items() if number)
                cells[engine] = (worst, ", ".join(f"{n} {_SHORT[w]}" for w, n in reversed(counts.items()) if n))
        rows.append(dict(name=case.name, title=case.title,
                         cells=[cells.get(engine, ("none", "")) for engine in engines]))
    return rows


def write(path, cases, round_, quirks):
    """Write the page and return its path."""
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["code"] = _code
    template = environment.from_string(Path(__file__).with_name("report.html.j2").read_text())
    counts = round_.counts()
    titles = {case.name: case.title for case in cases}
    told = [dict(case=v.case, title=titles[v.case], variant=v.variant, check=v.check.name, peer=v.peer, status=v.status, quirk=v.check.quirk,
                 word=_WORDS[v.status], difference=_number(v.difference), limit=_limit(v.check))
            for status in ("fail", "known") for v in round_.verdicts if v.status == status]
    missing = sorted({(o.engine, o.message) for o in round_.outcomes.values() if o.status == "missing"})
    html = template.render(
        engines=engines_of(cases), rows=matrix(cases, round_), cases=[_case(case, round_) for case in cases],
        counts=counts, told=told, missing=missing, words=_WORDS, versions=_versions(round_, engines_of(cases)), quirks=quirks, studies=studies(),
        starts=round_.starts, changes=round_.changes, odd=compare.odd_one_out(round_.verdicts),
        host=platform.platform(), cores=os.cpu_count(), date=datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
        seeds=", ".join(str(s) for s in sorted({t.scenario.get("packing", {}).get("seed") for c in cases for t in c.tasks} - {None})))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(plain(html))
    return path


def text(cases, round_, strict, verbose=False):
    """Text for the terminal: everything that does not simply pass, and the counts."""
    lines = []
    usual = {case.name: case.reference for case in cases}
    peers = lambda v: v.peer if v.reference == usual.get(v.case, v.reference) else f"{v.reference} and {v.peer}"
    for verdict in [*(v for v in round_.starts if v.status == "fail"), *round_.verdicts, *round_.changes]:
        if verbose or verdict.status != "pass":
            lines.append(f"{_WORDS[verdict.status]:17} {verdict.case} · {verdict.variant} · {verdict.check.name} · "
                         f"{peers(verdict)}: {_number(verdict.difference)} ({_limit(verdict.check)}) "
                         f"{verdict.message}".rstrip())
    for outcome in round_.outcomes.values():
        if outcome.status == "missing":
            lines.append(f"{'FAILS, ' if strict else ''}not installed · {outcome.case} · {outcome.variant} · "
                         f"{outcome.engine}: {outcome.message}")
        elif outcome.status != "done":
            word = "skipped" if outcome.status == "skipped" else "FAILS"
            lines.append(f"{word} · {outcome.case} · {outcome.variant} · {outcome.engine} {outcome.status}: {outcome.message}")
    for case, variant, check, engine in compare.odd_one_out(round_.verdicts):
        lines.append(f"odd one out: {engine} in {case} · {variant} · {check}")
    counts = round_.counts()
    lines.append(", ".join(f"{number} {_WORDS[word]}" for word, number in counts.items() if word != "skipped" or number))
    started = {word: sum(v.status == word for v in round_.starts) for word in ("pass", "fail", "skipped")}
    if round_.starts:
        lines.append(f"start states as the scenarios give them: {started['pass']} agree, {started['fail']} FAIL"
                     + (f", {started['skipped']} not compared" if started["skipped"] else ""))
    if round_.changes:
        lines.append(f"against the baseline: {sum(v.status == 'pass' for v in round_.changes)} the same, "
                     f"{sum(v.status == 'fail' for v in round_.changes)} changed")
    return plain("\n".join(lines))
