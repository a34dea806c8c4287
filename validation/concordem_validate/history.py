"""A page with a curve for each check over several rounds: its difference as a share of what is allowed."""
import html
from pathlib import Path

from . import rounds
from .errors import HarnessError

_WIDTH, _HEIGHT = 260, 56


def _share(verdict):
    limit = next((verdict[key][1] for key in ("known", "band") if verdict.get(key)), verdict.get("tolerance"))
    if verdict["difference"] is None:
        return None
    return verdict["difference"] / limit if limit else (0.0 if verdict["difference"] == 0 else 2.0)


def curves(folders):
    """Names of the rounds, and shares of each check over them."""
    records = sorted(((rounds.record(f)["date"], Path(f).name, rounds.record(f)) for f in folders), key=lambda r: r[:2])
    if len(records) < 2:
        raise HarnessError("a history needs at least two rounds; give their folders")
    out = {}
    for k, (_, _, record) in enumerate(records):
        for v in record["verdicts"]:
            key = f"{v['case']} · {v['variant']} · {v['check']} · {v['reference']} and {v['peer']}"
            out.setdefault(key, [None] * len(records))[k] = (_share(v), v["status"])
    return [f"{name}, {date}" for date, name, _ in records], out


def _svg(points):
    """A curve from 0 to twice what is allowed; the line in the middle is the limit."""
    step = _WIDTH / max(len(points) - 1, 1)
    y = lambda share: _HEIGHT - 3 - min(share, 2.0) / 2.0 * (_HEIGHT - 6)
    there = [(k * step, y(p[0]), p[1]) for k, p in enumerate(points) if p and p[0] is not None]
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b, _ in there)
    dots = "".join(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="2.5" fill="{"#c0392b" if s == "fail" else "#2c6fbb"}"/>' for a, b, s in there)
    return (f'<svg width="{_WIDTH + 6}" height="{_HEIGHT}" viewBox="-3 0 {_WIDTH + 6} {_HEIGHT}"><line x1="0" x2="{_WIDTH}" y1="{y(1)}" y2="{y(1)}" '
            f'stroke="#c0392b" stroke-dasharray="3 3"/><polyline points="{line}" fill="none" stroke="#2c6fbb"/>{dots}</svg>')


def write(path, folders):
    names, found = curves(folders)
    # what moved most comes first
    shares = lambda points: [p[0] for p in points if p and p[0] is not None]
    moved = lambda item: -(max(shares(item[1]), default=0.0) - min(shares(item[1]), default=0.0))
    last = lambda point: "" if not point or point[0] is None else f"{point[0]:.2g}"
    rows = "".join(f"<tr><td>{html.escape(name)}</td><td>{_svg(points)}</td><td>{last(points[-1])}</td></tr>"
                   for name, points in sorted(found.items(), key=moved))
    Path(path).write_text(
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>History of checks</title><style>body{font:14px system-ui;margin:20px auto;'
        'max-width:1000px}td{padding:2px 10px;border-top:1px solid #ddd}</style></head><body><h1>History of checks</h1>'
        f"<p>Difference as a share of what is allowed (dashed). Rounds: {html.escape('; '.join(names))}.</p>"
        f"<table><tr><th>check</th><th>share of the limit</th><th>last</th></tr>{rows}</table></body></html>\n")
    return Path(path)
