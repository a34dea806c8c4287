"""The record as tables of the docs, and as a plot."""

#: Rows of the summary: case, number of its ratio, what runs, spheres, program beside, threads.
SUMMARY = [
    ("cpm-yade-1", 0, "concrete", 18_699, "YADE", 1),
    ("cpm-yade-2", 0, "concrete", 18_699, "YADE", 2),
    ("cpm-yade-1", 1, "concrete, YADE's formulas", 18_699, "YADE", 1),
    ("cpm-yade-1", 2, "concrete, inside YADE", 18_699, "YADE", 1),
    ("small-breaking", 0, "whole run until concrete breaks", 1_160, "YADE", 1),
    ("small-breaking", 3, "the run inside YADE", 1_160, "YADE", 1),
    ("beams-lammps-10648", 0, "beams", 10_648, "LAMMPS, bpm/rotational", 1),
    ("hertz-liggghts-1", 0, "Hertz contacts", 10_648, "LIGGGHTS", 1),
    ("hertz-liggghts-2", 0, "Hertz contacts", 10_648, "LIGGGHTS", 2),
]
#: Figures of ConcorDEM alone: case, number of its ratio, what, unit.
ALONE = [
    ("threads", 0, "concrete: two threads over one", "times as fast"),
    ("deformable", 0, "deformable particles over rigid ones, linear bonds", "times the time"),
    ("breaking-steps", 0, "a step in which bonds break over a quiet one", "times the time"),
    ("sizes", 0, "time per bond: 10⁶ over 10⁵ spheres", "times the time"),
    ("sizes", 1, "time per bond: 10⁷ over 10⁵ spheres", "times the time"),
    ("memory", 0, "memory of a particle with six bonds of concrete", "kB"),
    ("start", 0, "start of a run of 10⁶ spheres, to the end of the first step", "s"),
]
#: Colors that color-blind readers tell apart (Okabe and Ito).
COLORS = {"YADE": "#0072B2", "LAMMPS": "#E69F00", "LIGGGHTS": "#009E73"}


def marks(name):
    """The comments around a block of a page."""
    return f"<!-- speed.py: {name} -->", f"<!-- end of {name} -->"


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


def _ratio(record, case, number):
    return record["cases"][case]["ratios"][number]


def summary(record):
    """What a reader wants first: how many times as fast, and what a run takes."""
    lines = [f"{record['machine']}; {record['date']}; medians of {record['rounds']} rounds.", "",
             "| Steps of | Times as fast | As | Threads | Spheres |", "|---|---|---|---|---|"]
    for case, number, what, spheres, program, threads in SUMMARY:
        ratio = _ratio(record, case, number)
        lines.append(f"| {what} | **{ratio['median']:.1f}** | {program} | {threads} | {spheres:,} |")
    lines += ["", "| ConcorDEM alone | |", "|---|---|"]
    lines += [f"| {what} | {_ratio(record, case, number)['median']:.2f} {unit} |" for case, number, what, unit in ALONE]
    return lines


def line(record):
    """One sentence for the README."""
    times = lambda case, number: f"{_ratio(record, case, number)['median']:.1f}"
    return [f"{record['machine'].split(',')[0]}, one thread: concrete {times('cpm-yade-1', 0)} times as fast as YADE ({times('cpm-yade-1', 2)} times inside YADE), "
            f"beams {times('beams-lammps-10648', 0)} times as fast as LAMMPS, Hertz contacts {times('hertz-liggghts-1', 0)} times as fast as LIGGGHTS."]


def step(record):
    """Where the time of a step of concrete goes, and its floor."""
    found = record["cases"]["cpm-yade-1"]["sides"]["ours"]
    stages = found["details"]["stages_ns"]
    whole = sum(stages.values())
    told = [("bonds", "bonds: gather, kinematics, law, store"), ("motion", "motion of the particles"), ("gather", "sum of the forces")]
    rows = [(text, stages[name]) for name, text in told]
    rows.append(("neighbor list, poses, and all else", whole - sum(value for _, value in rows)))
    lines = ["| Stage of a step of concrete | ns per bond | Share |", "|---|---|---|"]
    lines += [f"| {text} | {value:.1f} | {value / whole:.0%} |".replace("%", " %") for text, value in rows]
    return [*lines, "", *floor_lines(record)][:-1]


BLOCKS = {"figures": lambda record: table(record), "summary": summary, "line": line, "step": step}


def insert(page, record):
    """The text of a page with the blocks of the record between their marks; a page has at least one."""
    found = 0
    for name, lines in BLOCKS.items():
        begin, end = marks(name)
        if begin not in page:
            continue
        found += 1
        head, rest = page.split(begin, 1)
        _, tail = rest.split(end, 1)
        page = "\n".join([head + begin, *lines(record), end + tail])
    assert found, "a page without marks"
    return page


def plot(record, path):
    """Bars: how many times as fast as the other program."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    labels = [f"{what}\n{spheres:,} spheres, {threads} thread{'s' if threads > 1 else ''}" for _, _, what, spheres, _, threads in SUMMARY]
    figure, axes = plt.subplots(figsize=(8, 5.4))
    for y, (case, number, _, _, program, _) in enumerate(SUMMARY):
        ratio, name = _ratio(record, case, number), program.split(",")[0]
        axes.barh(-y, ratio["median"], color=COLORS[name], label=f"than {program}" if y == [one[4] for one in SUMMARY].index(program) else None)
        axes.plot([min(ratio["rounds"]), max(ratio["rounds"])], [-y, -y], color="black", linewidth=1.5)
        axes.text(max(ratio["rounds"]) + 0.2, -y, f"{ratio['median']:.1f}", va="center", fontsize=11)
    axes.axvline(1, color="0.3", linewidth=1, linestyle="--")
    axes.set_yticks([-y for y in range(len(SUMMARY))], labels, fontsize=9)
    axes.set_xlabel("ConcorDEM: times as fast (line: range of rounds)", fontsize=11)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=11, loc="lower right")
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)
