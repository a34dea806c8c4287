#!/usr/bin/env python3
"""Generate the pictures of gallery.md from small runs of the templates. They are committed; run this when the program changes.

    docs/book/make_gallery.py [--concordem PROGRAM]        about two minutes
"""

import argparse
import subprocess
import tempfile
from pathlib import Path

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

BOOK = Path(__file__).resolve().parent
IMAGES = BOOK / "images"
LIMIT = 150_000  # bytes of one picture

plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "figure.dpi": 110})


def run(program, folder, template, changes=()):
    """The result of a template, with keys replaced in its text."""
    path = folder / f"{template}-{len(list(folder.iterdir()))}.toml"
    subprocess.run([program, "init", "--template", template, path], check=True, capture_output=True)
    text = path.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text, (template, old)
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    subprocess.run([program, "run", "--quiet", path], check=True, stdout=subprocess.DEVNULL)
    return h5py.File(path.with_suffix(".h5"))


def save(figure, name):
    path = IMAGES / f"{name}.png"
    figure.tight_layout()
    figure.savefig(path)
    plt.close(figure)
    assert path.stat().st_size < LIMIT, f"{path} has {path.stat().st_size} bytes"


def curves(program, folder):
    """Stress and strain of a concrete prism in tension and in compression, and its energies."""
    figure, (tension, compression, energy) = plt.subplots(1, 3, figsize=(10, 3))
    pulled = run(program, folder, "cpm-small")
    pressed = run(program, folder, "cpm-small", [('strain_rate = "0.4 1/s"', 'strain_rate = "-3 1/s"'), ("drop_to = 0.2", "drop_to = 0.5")])
    for axis, result, sign, title in (tension, pulled, 1, "tension"), (compression, pressed, -1, "compression"):
        samples = result["samples"]
        axis.plot(sign * samples["strain"][:] * 1e3, sign * samples["stress"][:] / 1e6)
        axis.set(xlabel="strain, 1e-3", ylabel="stress, MPa", title=title)
    samples = pulled["samples"]
    stored = sum(samples[f"stored_{mode}"][:] for mode in ("normal", "shear"))
    parts = {"stored": stored, **{name.replace("_", " "): samples[name][:] for name in ("damage", "friction", "numerical_damping", "kinetic")}}
    energy.stackplot(samples["strain"][:] * 1e3, *[part * 1e3 for part in parts.values()], labels=parts)
    energy.plot(samples["strain"][:] * 1e3, samples["boundary_work"][:] * 1e3, "k--", linewidth=1, label="boundary work")
    energy.set(xlabel="strain, 1e-3", ylabel="energy, mJ", title="energy in tension")
    energy.legend(fontsize=7, loc="upper left")
    save(figure, "stress-strain")


def cracks(program, folder):
    """Broken bonds of a prism of cohesive beams in bending, colored by time."""
    figure, (curve, side) = plt.subplots(1, 2, figsize=(9, 3.2), width_ratios=[1, 1.6])
    result = run(program, folder, "beam-bending")
    samples = result["samples"]
    curve.plot(samples["strain"][:] * 1e3, samples["stress"][:] / 1e6)
    curve.set(xlabel="strain of the outer fiber, 1e-3", ylabel="stress of the outer fiber, MPa", title="bending of silica")
    centers = result["particles/position"][:] * 1e3
    side.scatter(centers[:, 0], centers[:, 1], s=30, color="0.9", linewidths=0)
    place = result["events/position"][:] * 1e3
    points = side.scatter(place[:, 0], place[:, 1], c=result["events/time"][:] * 1e6, s=10, cmap="viridis")
    side.set(aspect="equal", xlabel="x, mm", ylabel="y, mm", title=f"{len(place)} broken beams")
    figure.colorbar(points, ax=side, label="time, µs", shrink=0.8)
    save(figure, "bending-cracks")


def grains(program, folder):
    """A column of particles collapses: start and end."""
    figure, axes = plt.subplots(1, 3, figsize=(10, 2.2), sharex=True, sharey=True)
    result = run(program, folder, "granular-box", [("snapshot_interval = 1_000", "snapshot_interval = 100")])
    steps, points = result["VTKHDF/Steps"], result["VTKHDF/Points"]
    count = len(result["particles/id"])
    start, times = steps["PointOffsets"][:], steps["Values"][:]
    for axis, time in zip(axes, (0.0, 0.15, 1.0)):
        at = int(np.abs(times - time).argmin())
        place = points[start[at] : start[at] + count] * 1e3
        order = np.argsort(-place[:, 1])
        axis.scatter(place[order, 0], place[order, 2], s=38, c=place[order, 1], cmap="cividis", edgecolors="0.2", linewidths=0.3)
        axis.set(aspect="equal", xlim=(-50, 160), ylim=(-50, 60), xlabel="x, mm", title=f"t = {times[at]:.2f} s")
    axes[0].set(ylabel="z, mm")
    save(figure, "column-collapse")


def shock(program, folder):
    """A hot plate cooled at its lower face, the scenario of how-to/conduct-heat.md: temperatures and broken bonds."""
    page = (BOOK / "how-to/conduct-heat.md").read_text(encoding="utf-8")
    path = folder / "shock.toml"
    path.write_text(page.split("<!-- code: file=shock.toml -->\n```toml\n")[1].split("```")[0], encoding="utf-8")
    subprocess.run([program, "run", "--quiet", path], check=True, stdout=subprocess.DEVNULL)
    result = h5py.File(path.with_suffix(".h5"))
    count = len(result["particles/id"])
    place = result["VTKHDF/Points"][-count:] * 1e3
    temperature = result["VTKHDF/PointData/temperature"][-count:]
    figure, axis = plt.subplots(figsize=(9, 2.9))
    points = axis.tricontourf(place[:, 0], place[:, 1], temperature, 24, cmap="inferno")
    of = {id: at for at, id in enumerate(result["VTKHDF/PointData/id"][-count:])}
    for a, b in zip(result["events/id_a"][:], result["events/id_b"][:]):
        ends = place[[of[a], of[b]], :2]
        middle, along = ends.mean(axis=0), ends[1] - ends[0]
        across = 0.5 * np.array([-along[1], along[0]])
        axis.plot(*np.array([middle - across, middle + across]).T, color="tab:cyan", linewidth=1.4)
    axis.set(aspect="equal", xlabel="x, mm", ylabel="y, mm", title=f"{len(result['events/id_a'])} broken bonds")
    figure.colorbar(points, ax=axis, label="temperature, K", shrink=0.8)
    save(figure, "thermal-shock")


def mesoscale(program, folder):
    """Concrete on the mesoscale in tension: phases in a section, damaged bonds, and the curve beside that of mortar."""
    figure, (section, crack, curve) = plt.subplots(1, 3, figsize=(10, 3.4), width_ratios=[1, 1, 1.2])
    result = run(program, folder, "concrete-mesoscale")
    # The same cube without aggregates: the template without three tables.
    text = folder / "mortar.toml"
    subprocess.run([program, "init", "--template", "concrete-mesoscale", text], check=True, capture_output=True)
    kept, skip = [], False
    for line in text.read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            skip = line.startswith(("[aggregates", "[[aggregates", "[[interface"))
        if not skip:
            kept.append(line)
    text.write_text("\n".join(kept) + "\n", encoding="utf-8")
    subprocess.run([program, "run", "--quiet", text], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    mortar = h5py.File(text.with_suffix(".h5"))
    particles = result["particles"]
    place = (particles["position"][:] - particles["displacement"][:]) * 1e3
    square = (particles["radius"][:] * 1e3) ** 2 - place[:, 1] ** 2
    colors = np.array(["#ddd8cb", "#6b5847"])
    for (x, _, z), inside, material in zip(place, square, particles["material"][:]):
        if inside > 0:
            section.add_patch(plt.Circle((x, z), inside**0.5, color=colors[material], linewidth=0))
    section.set(title="mortar and aggregates")
    bonds = result["contacts/cpm"]
    near = (np.abs(bonds["position"][:, 1]) < 2e-3) & (bonds["damage"][:] > 0.99)
    stones = (particles["material"][:] == 1) & (np.abs(place[:, 1]) < 1.0)
    crack.scatter(place[stones, 0], place[stones, 2], s=24, color="#d8cdc2", linewidths=0)
    crack.scatter(*(bonds["position"][:][near][:, [0, 2]].T * 1e3), s=4, color="#b03020", linewidths=0)
    crack.set(title="bonds with a damage above 0.99")
    for axis in section, crack:
        axis.set(aspect="equal", xlim=(-16, 16), ylim=(-16, 16), xlabel="x, mm", ylabel="z, mm")
    for one, label in (result, "with aggregates"), (mortar, "mortar"):
        curve.plot(one["samples/strain"][:] * 1e3, one["samples/stress"][:] / 1e6, label=label)
    curve.set(xlabel="strain, 1e-3", ylabel="stress, MPa", title="tension")
    curve.legend(fontsize=8)
    save(figure, "mesoscale")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--concordem", type=Path, default=BOOK.parents[1] / "target/release/concordem", help="the program")
    program = parser.parse_args().concordem.resolve()
    with tempfile.TemporaryDirectory() as folder:
        for picture in (curves, cracks, grains, shock, mesoscale):
            picture(program, Path(folder))
            print(picture.__name__)


if __name__ == "__main__":
    main()
