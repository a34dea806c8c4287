"""Pictures of the README, the tutorials, and the how-to pages."""

import csv
import json
import re
import subprocess

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection

from .style import BLUE, BOOK, COLORS, GREEN, ORANGE, PURPLE, RED, SKY, beside, curve, rendered, sample, save, specimen, spheres

ROOT = BOOK.parents[1]


def first_specimen(runs):
    """The scenario of the README."""
    text = (ROOT / "README.md").read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0]
    save(specimen(runs.scenario("readme", text), "concrete prism in tension"), "first-specimen")


def pictures(runs):
    """The commands of how-to/draw-pictures.md."""
    prism = runs.template("cpm-small", "cpm-small-bonds", ["output.bond_snapshots=true"])
    grains = runs.template("granular-box", sets=("output.snapshot_interval=100",))
    beside([
        rendered(runs, prism, "open", "--cut", "y", "--magnify", "50", "--size", "560x760"),
        rendered(runs, prism, "cracks", "--show", "particles,cracks", "--size", "560x760"),
        rendered(runs, grains, "grains", "--time", "0.1 s", "--size", "800x760"),
    ], "pictures")


def pressed(runs):
    return runs.template("cpm-small", "cpm-small-pressed", ["loading.strain_rate=-3 1/s", "stop.drop_to=0.5"])


def curves(runs):
    """Tension, compression, and where the energy goes."""
    figure, (tension, compression, energy) = plt.subplots(1, 3, figsize=(12, 3.6))
    pulled = runs.template("cpm-small")
    curve(tension, pulled)
    tension.set_title("tension")
    curve(compression, pressed(runs), -1, "compressive strain, ‰", "compressive stress, MPa")
    compression.set_title("compression")
    stored = sum(sample(pulled, f"stored_{mode}") for mode in ("normal", "shear"))
    parts = {"stored": stored, **{name.replace("_", " "): sample(pulled, name) for name in ("damage", "friction", "numerical_damping", "kinetic")}}
    strain = sample(pulled, "strain") * 1e3
    energy.stackplot(strain, *[part * 1e3 for part in parts.values()], labels=parts, colors=[SKY, ORANGE, GREEN, PURPLE, RED])
    energy.plot(strain, sample(pulled, "boundary_work") * 1e3, "k--", linewidth=1.2, label="boundary work")
    energy.set(xlabel="strain, ‰", ylabel="energy, mJ", title="energy in tension")
    energy.legend(fontsize=9, loc="upper left", bbox_to_anchor=(1, 1))
    save(figure, "stress-strain")


def shock(runs):
    """A hot plate cooled at its lower face, the scenario of how-to/conduct-heat.md: temperatures and broken bonds."""
    page = (BOOK / "how-to/conduct-heat.md").read_text(encoding="utf-8")
    result = runs.scenario("shock", page.split("<!-- code: file=shock.toml -->\n```toml\n")[1].split("```")[0])
    count = len(result["particles/id"])
    place = result["VTKHDF/Points"][-count:] * 1e3
    temperature = result["VTKHDF/PointData/temperature"][-count:]
    figure, axis = plt.subplots(figsize=(9, 2.9))
    points = axis.tricontourf(place[:, 0], place[:, 1], temperature, 24, cmap="inferno")
    of = {id: at for at, id in enumerate(result["VTKHDF/PointData/id"][-count:])}
    lines = []
    for a, b in zip(result["events/id_a"][:], result["events/id_b"][:], strict=True):
        ends = place[[of[a], of[b]], :2]
        middle, along = ends.mean(axis=0), ends[1] - ends[0]
        across = 0.5 * np.array([-along[1], along[0]])
        lines.append([middle - across, middle + across])
    axis.add_collection(LineCollection(lines, colors=SKY, linewidths=1.4))
    axis.set(aspect="equal", xlabel="x, mm", ylabel="y, mm", title=f"{len(lines)} broken bonds (lines)")
    figure.colorbar(points, ax=axis, label="temperature, K", shrink=0.8)
    save(figure, "thermal-shock")


def mesoscale(runs):
    """Concrete on the mesoscale in tension: phases in a section, damaged bonds, and the curve beside mortar's."""
    figure, (section, crack, axis) = plt.subplots(1, 3, figsize=(12, 3.9), width_ratios=[1, 1, 1.15])
    result = runs.template("concrete-mesoscale")
    # The same cube without aggregates: the template without three tables.
    kept, skip = [], False
    for line in runs.text("concrete-mesoscale").splitlines():
        if line.startswith("["):
            skip = line.startswith(("[aggregates", "[[aggregates", "[[interface"))
        if not skip:
            kept.append(line)
    mortar = runs.scenario("mortar", "\n".join(kept) + "\n")
    particles = result["particles"]
    place = (particles["position"][:] - particles["displacement"][:]) * 1e3
    square = (particles["radius"][:] * 1e3) ** 2 - place[:, 1] ** 2
    colors = np.array(["#ddd8cb", "#6b5847"])
    for (x, _, z), inside, material in zip(place, square, particles["material"][:], strict=True):
        if inside > 0:
            section.add_patch(plt.Circle((x, z), inside**0.5, color=colors[material], linewidth=0))
    section.set(title="section: mortar (light), aggregates (dark)")
    bonds = result["contacts/cpm"]
    near = (np.abs(bonds["position"][:, 1]) < 2e-3) & (bonds["damage"][:] > 0.99)
    stones = (particles["material"][:] == 1) & (np.abs(place[:, 1]) < 1.0)
    crack.scatter(place[stones, 0], place[stones, 2], s=24, color="#d8cdc2", linewidths=0)
    crack.scatter(*(bonds["position"][:][near][:, [0, 2]].T * 1e3), s=4, color=RED, linewidths=0)
    crack.set(title="crack: bonds with damage > 0.99")
    for one in section, crack:
        one.set(aspect="equal", xlim=(-16, 16), ylim=(-16, 16), xlabel="x, mm", ylabel="z, mm")
    for one, label in (result, "with aggregates"), (mortar, "mortar"):
        curve(axis, one, label=label)
    axis.set_title("tension")
    axis.legend()
    save(figure, "mesoscale")


def packings(runs):
    """Three shapes cut from one packing, and one of many radii."""
    shapes = {
        "box": 'packing.shape={kind="box", size=["15 mm", "15 mm", "30 mm"]}',
        "cylinder": 'packing.shape={kind="cylinder", radius="8 mm", height="30 mm", axis="z"}',
        "hyperboloid": 'packing.shape={kind="hyperboloid", radius="8 mm", waist_radius="5 mm", height="30 mm", axis="z"}',
    }
    figure, axes = plt.subplots(1, 4, figsize=(11, 4.2))
    for axis, (name, shape) in zip(axes, shapes.items(), strict=False):
        spheres(axis, runs.template("cpm-small", f"shape-{name}", [shape, "stop.steps=1"]), color="#9db8cc")
        axis.set_title(name)
    text = runs.text("cpm-small").replace('radius = "1 mm"', 'radii = { kind = "uniform", minimum = "0.6 mm", maximum = "1.4 mm" }').replace("steps = 20_000", "steps = 1")
    spheres(axes[3], runs.scenario("radii", text), color="#9db8cc")
    axes[3].set_title("radii 0.6 to 1.4 mm")
    save(figure, "packings")


def cycles(runs):
    """Load, unload, load again."""
    stages = 'stage=[{name="a", stop={strain=2e-4}}, {name="b", rate=-1, stop={stress=0}}, {name="c", stop={strain=4e-4}}, ' \
             '{name="d", rate=-1, stop={stress=0}}, {name="e", stop={strain=8e-4}}]'
    figure, axis = plt.subplots(figsize=(6.5, 3.6))
    curve(axis, runs.template("cpm-small", "cycles", [stages, "stop={steps=60000}"]), label="in cycles")
    curve(axis, runs.template("cpm-small"), label="without cycles", linestyle="--")
    axis.legend()
    save(figure, "cycles")


def load_displacement(runs):
    """Force on a set over its displacement."""
    sets = ['set=[{name="top", selection={kind="layer", axis="z", end="maximum", thickness="4 mm"}}]',
            'sample=[{operator="set-force", set="top", interval=20}, {operator="set-motion", set="top", interval=20}]']
    result = runs.template("cpm-small", "set", sets)
    force, motion = result["samples/set-force"], result["samples/set-motion"]
    figure, axis = plt.subplots(figsize=(6.5, 3.6))
    axis.plot(motion["displacement"][:, 2] * 1e6, np.abs(force["force"][:, 2]) / 1e3)
    axis.set(xlabel="displacement of the set along z, µm", ylabel="force on the set, kN")
    save(figure, "load-displacement")


def damping(runs):
    """Work of the damping beside the boundary work, and curves at three rates."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6))
    for value, style in (0.1, "-"), (0.3, "--"), (0.7, ":"):
        one = runs.template("cpm-small", f"damping-{value}", [f"integration.damping.coefficient={value}"])
        left.plot(sample(one, "strain") * 1e3, 100 * sample(one, "numerical_damping") / np.maximum(sample(one, "boundary_work").max(), 1e-12), style, label=f"damping {value}")
    left.set(xlabel="strain, ‰", ylabel="work of the damping /\nwork of the load, %")
    left.legend()
    for value, style in ("0.4", "-"), ("3.2", "--"), ("12.8", ":"):
        one = runs.template("cpm-small", f"rate-{value}", [f"loading.strain_rate={value} 1/s"])
        curve(right, one, linestyle=style, label=f"{value} 1/s")
    right.legend()
    save(figure, "damping-and-rate")


def materials(runs):
    """The scenario of how-to/mix-materials.md: a section, and the curve beside the one without inclusion."""
    page = (BOOK / "how-to/mix-materials.md").read_text(encoding="utf-8")
    result = runs.scenario("mortar-inclusion", page.split("<!-- code: file=mortar.toml -->\n```toml\n")[1].split("```")[0])
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.8), width_ratios=[1, 1.6])
    place = result["particles/position"][:]
    material = result["particles/material"][:]
    circles = spheres(left, result, color=material, mask=place[:, 1] < 0, cmap="cividis")
    circles.set_clim(-0.3, 1)
    left.set_title("front half cut away")
    curve(right, result, label="stiff inclusion, weak interface")
    curve(right, runs.template("cpm-small"), linestyle="--", label="one material")
    right.legend()
    save(figure, "materials")


def emissions(runs):
    """The scenario of how-to/count-cracks.md: emissions in the specimen, and their numbers over the magnitude."""
    page = (BOOK / "how-to/count-cracks.md").read_text(encoding="utf-8")
    result = runs.scenario("rock", page.split("<!-- code: file=rock.toml -->\n```toml\n")[1].split("```")[0])
    table = subprocess.run([runs.program, "events", "rock.h5", "--csv"], check=True, capture_output=True, text=True, cwd=runs.folder).stdout
    rows = list(csv.DictReader(table.splitlines()))
    x, y, magnitude, shear = (np.array([float(row[name]) for row in rows]) for name in ("x [m]", "y [m]", "magnitude", "shear_share"))
    text = subprocess.run([runs.program, "events", "rock.h5"], check=True, capture_output=True, text=True, cwd=runs.folder).stdout
    b, complete = (float(number) for number in re.search(r"b-value +(\S+) ± .* magnitude (\S+) on", text).groups())
    figure, (body, numbers) = plt.subplots(1, 2, figsize=(11, 3.8), width_ratios=[3, 2])
    spheres(body, result, "xy")
    order = np.argsort(magnitude)
    points = body.scatter(x[order] * 1e3, y[order] * 1e3, s=6 * 4 ** (magnitude[order] - complete), c=shear[order], cmap="coolwarm", vmin=0, vmax=1, alpha=0.8)
    figure.colorbar(points, ax=body, label="share of shear")
    steps = np.sort(magnitude)
    numbers.semilogy(steps, np.arange(len(steps), 0, -1), color=BLUE, label="emissions")
    counting = (magnitude >= complete).sum()
    line = np.array([complete, steps.max()])
    numbers.semilogy(line, counting * 10 ** (-b * (line - complete)), "--", color=RED, label=f"b = {b:.2f}")
    numbers.axvline(complete, color="0.7", linewidth=1)
    numbers.set(xlabel="magnitude", ylabel="emissions of at least this magnitude", ylim=(0.7, None))
    numbers.legend()
    save(figure, "emissions")


def fragments(runs):
    """The scenario of how-to/count-cracks.md: emissions over the load, directions of cracks, sieve curve."""
    page = (BOOK / "how-to/count-cracks.md").read_text(encoding="utf-8")
    runs.scenario("rock", page.split("<!-- code: file=rock.toml -->\n```toml\n")[1].split("```")[0])

    def columns(*arguments):
        done = subprocess.run([runs.program, *arguments], check=True, capture_output=True, text=True, cwd=runs.folder)
        rows = list(csv.DictReader(done.stdout.splitlines()))
        return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}

    figure = plt.figure(figsize=(12, 3.6))
    load = figure.add_subplot(1, 3, 1)
    over = columns("events", "rock.h5", "--csv=load")
    load.plot(-over["strain"] * 1e3, over["load [Pa]"] / 1e6, color=BLUE)
    load.set(xlabel="compressive strain, ‰", ylabel="compressive stress, MPa")
    heard = load.twinx()
    heard.plot(-over["strain"] * 1e3, over["emissions"], "--", color=RED)
    heard.set_ylabel("emissions so far (dashed)")
    heard.spines["right"].set_visible(True)
    rose = figure.add_subplot(1, 3, 2, projection="polar")
    directions = columns("events", "rock.h5", "--csv=rose", "--across", "z")
    angle, area = np.radians(directions["angle [deg]"]), directions["area [m²]"] * 1e6
    rose.bar(np.concatenate([angle, angle + np.pi]), np.tile(area, 2), width=np.pi / len(angle), color=SKY, edgecolor="white")
    rose.set_title("normals of cracks, mm²; load along 0°")
    sieve = figure.add_subplot(1, 3, 3)
    curve_of = columns("fragments", "rock.h5", "--csv=curve")
    sieve.semilogx(curve_of["size [m]"] * 1e3, curve_of["passing"] * 100, drawstyle="steps-post", color=GREEN)
    sieve.set(xlabel="size, mm", ylabel="mass passing, %", ylim=(0, 101))
    sieve.set_xticks([2, 5, 10, 20], ["2", "5", "10", "20"])
    sieve.minorticks_off()
    figure.tight_layout()
    save(figure, "fragments")


def bonds(runs):
    """What an export shows: bonds as lines, colored by their damage, with large displacements."""
    result = runs.template("cpm-small")
    place = result["particles/position"][:] + 20 * result["particles/displacement"][:]
    of = {id: at for at, id in enumerate(result["particles/id"][:])}
    table = result["contacts/cpm"]
    damage = table["damage"][:]
    order = np.argsort(damage)
    pairs = np.array([[of[a], of[b]] for a, b in table["ids"][:]])[order]
    # Displacements across the border of the packing do not occur: the prism is not periodic.
    lines = place[pairs][:, :, [0, 2]] * 1e3
    figure, axis = plt.subplots(figsize=(5.4, 5.2))
    drawn = LineCollection(lines, array=damage[order], cmap="viridis_r", linewidths=0.7)
    axis.add_collection(drawn)
    axis.set(aspect="equal", xlim=(-10, 10), ylim=(-17, 17), xlabel="x, mm", ylabel="z, mm", title="bonds, displacements × 20")
    figure.colorbar(drawn, ax=axis, label="damage", shrink=0.8)
    save(figure, "bonds")


def structure(runs):
    """What `concordem characterise` measures: solid fraction by depth, and the pair correlation."""
    runs.text("cpm-small")
    path = runs.folder / "cpm-small.structure.json"
    if not path.exists():
        runs.call("characterise", "cpm-small.toml")
    found = json.loads(path.read_text(encoding="utf-8"))
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.5))
    depth = found["layers"]
    left.plot(np.array(depth["depth"]) * 1e3, depth["solid_fraction"])
    left.set(xlabel="depth below the surface, mm", ylabel="solid fraction", ylim=(0, None))
    correlation = found["pair_correlation"]
    diameter = 2 * found["radii"]["mean"]
    right.plot(np.array(correlation["distance"]) / diameter, correlation["g"])
    right.axhline(1, color="0.5", linewidth=1, linestyle="--")
    right.set(xlabel="distance / diameter", ylabel="pair correlation g")
    save(figure, "structure")


def table(name):
    """A recorded sweep: values of the first axis, and one row of results per seed."""
    with (BOOK / f"data/{name}.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    axis = next(iter(rows[0]))
    values = list(dict.fromkeys(row[axis] for row in rows))
    return values, {value: [row for row in rows if row[axis] == value] for value in values}


def spread(rows, key, scale):
    found = np.array([float(row[key]) for row in rows]) / scale
    return found.mean(), found.std(ddof=1)


def study(_runs):
    """Strengths over rate, size, and damping: means and standard deviations over the seeds."""
    figure, (rates, presses, sizes) = plt.subplots(1, 3, figsize=(12, 3.8))
    number = lambda text: abs(float(re.match(r"-?[\d.]+", text)[0]))
    for axis, name, key, label in (rates, "rates", "f_t", "tensile strength, MPa"), (presses, "press", "f_c", "compressive strength, MPa"):
        values, rows = table(name)
        found = [spread(rows[value], key, 1e6) for value in values]
        axis.errorbar([number(value) for value in values], [one[0] for one in found], [one[1] for one in found], fmt="o-", capsize=4)
        axis.set(xscale="log", xlabel="strain rate, 1/s", ylabel=label)
        axis.set_xticks([number(value) for value in values], [f"{number(value):g}" for value in values])
        axis.minorticks_off()
        axis.set_ylim(0, 1.25 * max(one[0] for one in found))
    values, rows = table("sizes")
    across = [number(value.strip('["')) / 2 for value in values]
    for key, scale, color, label in ("f_t", 1e6, BLUE, "tensile strength, MPa"), ("E_gauge", 1e10, ORANGE, "E, 10 GPa"):
        found = [spread(rows[value], key, scale) for value in values]
        sizes.errorbar(across, [one[0] for one in found], [one[1] for one in found], fmt="o-", capsize=4, color=color, label=label)
    sizes.set(xlabel="spheres across the prism", ylabel="mean ± standard deviation", ylim=(0, None))
    sizes.legend()
    save(figure, "study")


def paper(runs):
    """Five seeds in tension and in compression: mean curve and band."""
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.4))
    cases = (axes[0], "seed", [], 1, 6e-4, COLORS[0]), (axes[1], "pressed-seed", ["loading.strain_rate=-3 1/s", "stop.drop_to=0.5"], -1, 4e-3, COLORS[3])
    for axis, name, sets, sign, end, color in cases:
        strain, stresses = np.linspace(0, end, 200), []
        for seed in range(1, 6):
            one = runs.template("cpm-small", f"{name}-{seed}", [f"packing.seed={seed}", *sets])
            # Beyond its end a curve is not known.
            stresses.append(np.interp(strain, sign * sample(one, "strain"), sign * sample(one, "stress"), right=np.nan) / 1e6)
        mean, deviation = np.mean(stresses, axis=0), np.std(stresses, axis=0, ddof=1)
        axis.fill_between(strain * 1e3, mean - deviation, mean + deviation, color=color, alpha=0.25, linewidth=0, label="± standard deviation")
        axis.plot(strain * 1e3, mean, color=color, label="mean of five packings")
        word = "" if sign > 0 else "compressive "
        axis.set(xlabel=f"{word}strain, ‰", ylabel=f"{word}stress, MPa", xlim=(0, None), ylim=(0, None))
        axis.legend(fontsize=9)
    save(figure, "paper")


def round_robin(_runs):
    """What Dosta et al. count, in small, in three codes from one start: as recorded by validation/round_robin.py."""
    data = json.loads((BOOK.parents[1] / "validation/results/round-robin.json").read_text(encoding="utf-8"))
    # one or two spheres are no curve
    curves = [(name, label, by_engine) for name in ("silo", "penetration", "drum") for label, by_engine in data[name]["curves"].items()
              if name != "drum" or max(by_engine["concordem"][1]) > 2]
    figure, axes = plt.subplots(2, -(-len(curves) // 2), figsize=(12, 6), layout="constrained")
    styles = {"concordem": ("ConcorDEM", "-", BLUE, 3.0), "yade": ("YADE", "--", ORANGE, 1.8), "liggghts": ("LIGGGHTS", ":", RED, 1.8)}
    for axis, (name, label, by_engine) in zip(axes.flat, curves):
        for engine, (x, y) in by_engine.items():
            word, line, color, width = styles[engine]
            axis.plot(x, y, line, color=color, linewidth=width, label=word)
        axis.set(title=f"{name}: {label}", xlabel="time, s", ylim=(None if name == "penetration" else 0, None))
    axes.flat[0].legend()
    for axis in axes.flat[len(curves):]:
        axis.remove()
    save(figure, "round-robin")


def jointed_rock(runs, name, shape=None, strong=True, joint=True, stiff=False, confined=False):
    """The rock of how-to/rock-joints.md with another joint, or with its membrane."""
    page = (BOOK / "how-to/rock-joints.md").read_text(encoding="utf-8")
    text = page.split("<!-- code: file=rock.toml -->\n```toml\n")[1].split("```")[0]
    if shape:
        text = re.sub(r"(?m)^shape = \{ kind = \"plane\".*$", f"shape = {shape}", text)
    if stiff:
        text = text.replace('"2e3 GPa/m"', '"1e4 GPa/m"').replace('"1e3 GPa/m"', '"5e3 GPa/m"')
    if not joint:
        text = re.sub(r"(?s)\[\[joint\]\].*?\n\n", "", text)
    if confined:
        text = re.sub(r'(?m)^(tensile_strength = "2 MPa"|cohesion = "2 MPa"|drop_to|steps).*\n', "", text)
        text += page.split("<<'END'\n")[1].split("END\n")[0]
    return runs.scenario(name, text)


def plane_of_weakness(dip, cohesion, lateral, friction=30):
    """Jaeger (1960): stress at which a plane slips; no number where it cannot."""
    dip, slope = np.radians(dip), np.tan(np.radians(friction))
    below = (1 - slope / np.tan(dip)) * np.sin(2 * dip)
    return np.where(below > 1e-9, lateral + 2 * (cohesion + lateral * slope) / np.maximum(below, 1e-9), np.nan)


def rock_joints(runs):
    """Strength over the dip of a joint, alone and under a membrane, beside the plane of weakness."""
    figure, (alone, confined) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    plane = lambda dip: f"{{ kind = \"plane\", point = [0, 0, 0], normal = [{np.sin(np.radians(dip)):.6f}, 0, {np.cos(np.radians(dip)):.6f}] }}"
    dips, line = [1e-6, 15, 30, 40, 45, 50, 55, 60, 75, 90], np.linspace(30.5, 89.5, 400)
    compression = lambda result: -sample(result, "stress") / 1e6
    whole = compression(jointed_rock(runs, "joint-none", joint=False)).max()
    print(f"without joint: {whole:.2f} MPa")
    alone.axhline(whole, color="0.4", linewidth=1.2, linestyle=":", label="without joint")
    jaeger = plane_of_weakness(line, 2, 0)
    alone.plot(line[jaeger < whole], jaeger[jaeger < whole], color="0.2", label="Jaeger, c = 2 MPa")
    for stiff, mark, color, label in (False, "o", BLUE, "joint of 2·10³ GPa/m"), (True, "s", ORANGE, "joint of 10⁴ GPa/m"):
        peaks = [compression(jointed_rock(runs, f"joint-{'stiff' if stiff else 'soft'}-{dip:.0f}", plane(dip), stiff=stiff)).max() for dip in dips]
        alone.plot(dips, peaks, mark, color=color, markersize=6, label=label)
        print(label, *(f"{dip:.0f}°: {peak:.2f} ({peak / at:.2f})" for dip, peak, at in zip(dips, peaks, plane_of_weakness(np.array(dips), 2, 0), strict=True)))
    alone.set(xlabel="dip of the joint, °", ylabel="strength, MPa", ylim=(0, 62), title="cohesion 2 MPa, no lateral pressure")
    alone.legend(fontsize=9, loc="center", bbox_to_anchor=(0.625, 0.62))
    confined.plot(line, plane_of_weakness(line, 0, 2), color="0.2", label="Jaeger, c = 0")
    for dip in (40, 45, 50, 55, 60):
        result = jointed_rock(runs, f"joint-confined-{dip}", plane(dip), confined=True)
        stress = compression(result)[-sample(result, "strain") > 0.9e-3] / inside(result)
        print(f"confined, {dip}°: {stress.mean():.2f} ± {stress.std():.2f}, {stress.mean() / plane_of_weakness(dip, 0, 2):.3f} of Jaeger, area {inside(result):.3f}")
        confined.errorbar(dip, stress.mean(), stress.std(), fmt="o", color=BLUE, capsize=3, label="joint, mean and scatter while it slides" if dip == 40 else None)
    confined.set(xlabel="dip of the joint, °", ylabel="axial stress, MPa", xlim=(35, 65), ylim=(0, 16), title="no cohesion, lateral pressure 2 MPa")
    confined.legend(fontsize=9)
    save(figure, "rock-joints")


def inside(result):
    """Mean share of the cross-section of 20 × 20 mm inside the hull of the centers, in slices of a diameter away from the ends."""
    from scipy.spatial import ConvexHull

    start = result["particles/position"][:] - result["particles/displacement"][:]
    layers = [start[np.abs(start[:, 2] - z) < 1e-3][:, :2] for z in np.arange(-15e-3, 15.5e-3, 2e-3)]
    return np.mean([ConvexHull(layer).volume for layer in layers]) / 4e-4


def joint_shapes(runs):
    """Sections of rock with a plane, a set, a disc, and a surface, and their cracks."""
    page = (BOOK / "how-to/rock-joints.md").read_text(encoding="utf-8")
    exec(page.split("```python\n")[1].split("```")[0].replace('"wave.stl"', repr(str(runs.folder / "wave.stl"))), {})  # the page's own code
    shapes = dict(zip(("set", "disc", "wave"), re.findall(r"--set 'joint\[0\]\.shape=(.*)'", page), strict=True))
    titles = {"plane": "one plane", "set": "five planes", "disc": "disc", "wave": "wavy surface"}
    figure, axes = plt.subplots(1, 4, figsize=(11, 5.2), sharey=True, layout="constrained")
    for axis, (name, title) in zip(axes, titles.items(), strict=True):
        result = jointed_rock(runs, f"joint-shape-{name}", shapes.get(name))
        moved = result["particles/displacement"][:]
        start = result["particles/position"][:] - moved
        section = np.abs(start[:, 1]) < 1.2e-3
        circles = spheres(axis, result, color=moved[:, 0] * 1e6, mask=section, cmap="cividis")
        circles.set_clim(*(np.percentile(moved[:, 0], [2, 98]) * 1e6))
        place, shear = result["events/position"][:] * 1e3, result["events/in_shear"][:] > 0
        near = np.abs(place[:, 1]) < 1.2
        axis.scatter(*place[near & ~shear][:, [0, 2]].T, s=9, color=SKY, linewidths=0, zorder=3, label="in tension")
        axis.scatter(*place[near & shear][:, [0, 2]].T, s=9, color=RED, linewidths=0, zorder=4, label="in shear")
        peak = -sample(result, "stress").min() / 1e6
        print(f"{title}: {peak:.2f} MPa, {len(shear)} events")
        axis.set_title(f"{title}: {peak:.1f} MPa")
        figure.colorbar(circles, ax=axis, location="bottom", label="displacement along x, µm")
    for axis in axes[1:]:
        axis.set_ylabel("")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, markerscale=2, title="bonds that broke")
    save(figure, "joint-shapes")


PICTURES = {
    "round-robin": round_robin,
    "emissions": emissions,
    "fragments": fragments,
    "first-specimen": first_specimen,
    "stress-strain": curves,
    "thermal-shock": shock,
    "mesoscale": mesoscale,
    "packings": packings,
    "structure": structure,
    "cycles": cycles,
    "load-displacement": load_displacement,
    "damping-and-rate": damping,
    "materials": materials,
    "bonds": bonds,
    "pictures": pictures,
    "study": study,
    "paper": paper,
    "rock-joints": rock_joints,
    "joint-shapes": joint_shapes,
}
