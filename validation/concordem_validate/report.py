"""The report."""


def write(path, cases, round_):
    return path


def text(cases, round_, strict):
    lines = []
    for v in round_.verdicts:
        limit = f"known {v.check.known[0]:g}…{v.check.known[1]:g}" if v.check.known else f"≤ {v.check.tolerance:g}"
        lines.append(f"{v.status:7} {v.case} · {v.variant} · {v.check.name} · {v.peer}: {v.difference:.3g} ({limit}) {v.message}".rstrip())
    for o in round_.outcomes.values():
        if o.status != "done":
            lines.append(f"{'FAIL' if strict or o.status != 'missing' else o.status:7} {o.case} · {o.variant} · {o.engine}: {o.status}: {o.message}")
    counts = {s: sum(v.status == s for v in round_.verdicts) for s in ("pass", "known", "fail", "missing")}
    lines.append(", ".join(f"{n} {s}" for s, n in counts.items()))
    return "\n".join(lines)
