"""The record as tables of the docs, and as a plot."""

BEGIN, END = "<!-- speed.py: figures -->", "<!-- end of figures -->"


def _wanted(ratio):
    """The goal as text, for example " (≥ 12)"; empty if there is none."""
    return "" if ratio["goal"] is None else f" ({'≥' if ratio['at_least'] else '≤'} {ratio['goal']:g})"


def _goal(ratio):
    if ratio["goal"] is None:
        return "none"
    reached = ratio["median"] >= ratio["goal"] if ratio["at_least"] else ratio["median"] <= ratio["goal"]
    return f"{'≥' if ratio['at_least'] else '≤'} {ratio['goal']:g}{'' if reached else ', missed'}"


def table(record):
    """Lines of Markdown."""
    lines = [
        f"{record['machine']}; {record['date']}, commit {record['commit'][:12]}; {record['seconds'] / 60:.0f} minutes, load average "
        f"{record['load_average'][0]:.1f} to {record['load_average'][1]:.1f}. Medians of {record['rounds']} rounds.",
        *([f"Not measured with this commit: {', '.join(record['missing'])}."] if record.get("missing") else []),
        "",
        "| Case | Ratio | Median | Rounds | Goal | Same physics |",
        "|---|---|---|---|---|---|",
    ]
    for case in record["cases"].values():
        same = "; ".join(f"{c['key'].replace('_', ' ')}: {c['difference']:.0e} (at most {c['tolerance']:g})" for c in case["checks"])
        for k, ratio in enumerate(case["ratios"]):
            low, high = min(ratio["rounds"]), max(ratio["rounds"])
            lines.append(f"| {case['what'] if k == 0 else ''} | {ratio['name']} | {ratio['median']:.2f} | {low:.2f} to {high:.2f} | "
                         f"{_goal(ratio)} | {same if k == 0 else ''} |")
    lines += ["", "Nanoseconds per contact and step, and bytes per contact of our blocks (scratch of the solver apart):", "",
              "| Case | Program | ns | Bytes |", "|---|---|---|---|"]
    for name, case in record["cases"].items():
        for side, found in case["sides"].items():
            details = found["details"]
            held = f"{details['bytes_per_bond']} + {details['scratch_bytes_per_bond']:.0f}" if "bytes_per_bond" in details else ""
            lines.append(f"| {name} | {side} | {found['ns']:.1f} | {held} |")
    lines += [""] + floor_lines(record) + stage_lines(record)
    return lines


def floor_of(record):
    """Floor of a step of the concrete specimen (ns per bond) and the share of it, or None."""
    case = record["cases"].get("cpm-yade-1")
    if not case:
        return None
    found = case["sides"]["ours"]
    held = found["details"]["bytes_per_bond"] + found["details"]["scratch_bytes_per_bond"]
    floor = held / record["memory"]["read_bytes_per_s"] * 1e9
    return floor, floor / found["ns"]


def floor_lines(record):
    memory, floor = record["memory"], floor_of(record)
    line = (f"Memory, one core: {memory['read_bytes_per_s'] * 1e-9:.1f} GB/s read, {memory['copy_bytes_per_s'] * 1e-9:.1f} GB/s copied "
            "(bytes read plus bytes written).")
    if floor:
        line += f" Reading all bytes of a bond once takes {floor[0]:.1f} ns: {floor[1] * 100:.0f} % of a step of concrete (goal 40 %)."
    return [line, ""]


def stage_lines(record):
    rows = [(name, side, found["details"]["stages_ns"]) for name, case in record["cases"].items()
            for side, found in case["sides"].items() if "stages_ns" in found["details"]]
    if not rows:
        return []
    names = list(rows[0][2])
    lines = ["Stages of our step, ns per contact (wall clock):", "", "| Case | Side | " + " | ".join(names) + " |",
             "|---|---|" + "---|" * len(names)]
    return lines + [f"| {name} | {side} | " + " | ".join(f"{stages[n]:.1f}" for n in names) + " |" for name, side, stages in rows]


def insert(page, record):
    """The text of a page with the tables of the record between the marks."""
    head, rest = page.split(BEGIN, 1)
    _, tail = rest.split(END, 1)
    return "\n".join([head + BEGIN, *table(record), END + tail])


def plot(record, path):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    rows = [(f"{name}: {ratio['name']}{_wanted(ratio)}", ratio) for name, case in record["cases"].items() for ratio in case["ratios"]]
    figure, axes = plt.subplots(figsize=(8, 0.4 * len(rows) + 1))
    for y, (_, ratio) in enumerate(reversed(rows)):
        axes.barh(y, ratio["median"], color="tab:blue", alpha=0.6)
        axes.plot([min(ratio["rounds"]), max(ratio["rounds"])], [y, y], color="black", lw=1)
        if ratio["goal"] is not None:
            axes.plot(ratio["goal"], y, "|", color="tab:red", markersize=14)
    axes.set_yticks(range(len(rows)), [name for name, _ in reversed(rows)], fontsize=8)
    axes.set_xlabel("ratio of times (memory: kB per particle; start: s); bar: median, line: range of rounds, red: goal")
    # Long labels widen the picture.
    figure.savefig(path, dpi=120, bbox_inches="tight")
