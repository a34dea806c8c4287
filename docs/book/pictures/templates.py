"""One picture for each template: images/templates/NAME.png."""

import h5py
import matplotlib.pyplot as plt
import numpy as np

from .style import BLUE, GREEN, ORANGE, beside, cracks, curve, rendered, sample, save, specimen, spheres

COMPRESSION = {"strain": "compressive strain, ‰", "stress": "compressive stress, MPa"}
#: Templates whose picture is a curve with the cracks behind it.
SPECIMENS = {
    "cpm-small": ("concrete prism in tension", {}),
    "cpm-specimen-tension": ("concrete cube of 50 mm in tension", {}),
    "cpm-specimen-compression": ("concrete cube of 50 mm in compression", {"sign": -1, "slice": 1, "events": "damaged bonds in a slice of 1 mm", **COMPRESSION}),
    "concrete-splitting": ("concrete cylinder between plates", {"strain_sign": -1, "strain": "approach of the plates / distance, ‰", "stress": "splitting stress, MPa"}),
    "concrete-mesoscale": ("concrete with aggregates in tension", {}),
    "concrete-fibers": ("concrete with steel fibers in tension", {}),
    "beam-tension": ("silica cylinder in tension", {"unit": "µs", "plane": "xy", "events": "broken beams"}),
    "beam-torsion": ("silica cylinder in torsion", {"unit": "µs", "plane": "xy", "events": "broken beams", "strain": "shear angle at the surface, 1e-3", "stress": "shear stress at the surface, MPa"}),
    "beam-bending": ("silica prism in bending", {"unit": "µs", "plane": "xy", "events": "broken beams", "strain": "strain of the outer fiber, ‰", "stress": "stress of the outer fiber, MPa"}),
    "linear-bond-bar": ("bar of discs in tension", {"unit": "ms", "plane": "xy", "events": "broken bonds"}),
}


def specimens(runs, name):
    title, words = SPECIMENS[name]
    return specimen(runs.template(name), title, **words)


def bending(runs, name):
    """Load over the opening of the crack mouth, which every standard asks for."""
    result = runs.template(name)
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), width_ratios=[1, 1.5])
    opening = result["samples/crack mouth"]
    times = opening["time"][:]
    stress = np.interp(times, sample(result, "time"), sample(result, "stress"))
    left.plot(opening["elongation"][:] * 1e6, stress / 1e6)
    left.set(xlabel="opening of the crack mouth, µm", ylabel="bending stress 3Fl/2bh², MPa", title="notched concrete beam")
    right.set_title(f"{cracks(right, result, 'xz')} bonds whose damage passed 0.9")
    return figure


def indentation(runs, name):
    """A plate with both failure criteria of Jebahi et al. 2015, sections 4.2.4.3 and 4.3.4."""
    beams = 'tensile_strength = "292 MPa"\nbending_term = "mid-section"\n'
    text = runs.text(name)
    assert text.count(beams) == 1
    particles = runs.scenario(f"{name}-particles", text.replace(beams, 'hydrostatic_strength = "64 MPa"\n'))
    figure, axes = plt.subplots(2, 1, figsize=(8.5, 7.4))
    for axis, result, criterion in (axes[0], runs.template(name), "strength of beams, 292 MPa"), (axes[1], particles, "strength of particles, 64 MPa"):
        count = cracks(axis, result, "xy", "µs", size=5)
        axis.add_patch(plt.Circle((0, 3 + 5), 5, facecolor="0.55", edgecolor="none"))
        axis.set_ylim(axis.get_ylim()[0], 4.4)
        axis.set_title(f"{criterion}: {count} broken beams")
    return figure


def grains(runs, name):
    """Start, middle, and end of a collapse."""
    result = runs.template(name, sets=("output.snapshot_interval=100",))
    options = ("--view", "-0.3,-1,0.25", "--range=0,0.6", "--size", "700x480")
    beside([rendered(runs, result, f"{name}-{time}", "--time", f"{time} s", *options) for time in (0, 0.15, 1)], f"templates/{name}", 330)


def impact(runs, name):
    result = runs.template(name)
    figure, axis = plt.subplots(figsize=(6.5, 3.4))
    time = sample(result, "time") * 1e6
    for key, label in ("kinetic", "kinetic"), ("stored_normal", "stored in the contact"), ("viscous", "dissipated by the dashpot"):
        axis.plot(time, sample(result, key) * 1e6, label=label)
    axis.set(xlabel="time, µs", ylabel="energy, µJ", title="two glass spheres collide")
    axis.legend()
    return figure


def gauges(runs, name, title, scale=1e6, names=None):
    """Axial stress over time at every gauge of a bar."""
    result = runs.template(name)
    figure, axis = plt.subplots(figsize=(7.5, 3.4))
    found = [one for one in result["samples"] if isinstance(result["samples"][one], h5py.Group) and "stress" in result["samples"][one]]
    for one in names or found:
        table = result["samples"][one]
        axis.plot(table["time"][:] * 1e6, table["stress"][:].reshape(-1, 9)[:, 0] / scale, label=one)
    axis.set(xlabel="time, µs", ylabel="axial stress, MPa", title=title)
    axis.legend()
    return figure


def cell(runs, name):
    result = runs.template(name)
    figure, axis = plt.subplots(figsize=(6, 3.4))
    curve(axis, result)
    axis.set_title("periodic cell of concrete, stretched along z")
    return figure


def triaxial(runs, name, own, others, rock):
    """Compression of the cell at its own lateral pressure (MPa) and at two others."""
    result = runs.template(name)
    figure, axis = plt.subplots(figsize=(8.5, 3.6))
    for pressure, color in zip(sorted([own, *others]), (GREEN, BLUE, ORANGE), strict=True):
        if pressure == own:
            one = result
        else:
            one = runs.template(name, f"{name}-{pressure}", [f'loading.stress=[["-{pressure} MPa",0,0],[0,"-{pressure} MPa",0],[0,0,"-{pressure} MPa"]]'])
        axis.plot(-sample(one, "strain") * 1e3, -sample(one, "stress") / 1e6, color=color, label=f"lateral pressure {pressure} MPa")
    axis.set(xlabel="axial compressive strain, ‰", ylabel="axial compressive stress, MPa", title=f"triaxial compression of {rock}")
    axis.legend(loc="upper left", bbox_to_anchor=(1, 1))
    return figure


def discs(runs, name):
    result = runs.template(name)
    figure, axes = plt.subplots(1, 2, figsize=(7.5, 4.4))
    for axis, along, title in (axes[0], 0, "the bar gets thicker"), (axes[1], 1, "and shorter"):
        displacement = result["particles/displacement"][:, along] * 1e6
        circles = spheres(axis, result, "xy", displacement, cmap="cividis")
        figure.colorbar(circles, ax=axis, label=f"displacement along {'xy'[along]}, µm", shrink=0.9)
        axis.set_title(title)
    return figure


def sweep(runs, name):
    """E over the interaction ratio, mean of three packings."""
    runs.text("cpm-periodic")
    runs.text(name)
    path = runs.folder / f"{name}.h5"
    if not path.exists():
        runs.call("sweep", f"{name}.toml", "--csv")
    table = np.genfromtxt(path.with_suffix(".csv"), delimiter=",", names=True, dtype=None, encoding="utf-8")
    keys = table.dtype.names
    figure, axis = plt.subplots(figsize=(6.5, 3.6))
    ratios, young = table[keys[1]], table["young"]
    found = sorted(set(ratios))
    for value, style in zip((found[0], found[len(found) // 2], found[-1]), ("-o", "--s", ":^"), strict=True):
        chosen = ratios == value
        xs = sorted(set(table[keys[0]][chosen]))
        axis.plot(xs, [young[chosen & (table[keys[0]] == x)].mean() / 1e9 for x in xs], style, label=f"G/E of bonds {value:.3g}")
    axis.set(xlabel="interaction ratio", ylabel="E, GPa", title="elastic constants of packings, mean of three")
    axis.legend()
    return figure


OTHERS = {
    "concrete-bending": bending,
    "beam-indentation": indentation,
    "hertz-impact": impact,
    "beam-impact": lambda runs, name: gauges(runs, name, "pulse in a slender silica cylinder"),
    "concrete-hopkinson": lambda runs, name: gauges(runs, name, "split Hopkinson bar", names=["incident bar", "transmission bar"]),
    "cpm-periodic": cell,
    "concrete-triaxial": lambda runs, name: triaxial(runs, name, 5, (2, 10), "concrete"),
    "rock-triaxial": lambda runs, name: triaxial(runs, name, 10, (2, 30), "rock"),
    "deformable-discs": discs,
    "elastic-sweep": sweep,
}
PICTURES = {f"templates/{name}": (lambda runs, name=name: save(specimens(runs, name), f"templates/{name}")) for name in SPECIMENS}
PICTURES |= {f"templates/{name}": (lambda runs, name=name, draw=draw: save(draw(runs, name), f"templates/{name}")) for name, draw in OTHERS.items()}
PICTURES["templates/granular-box"] = lambda runs: grains(runs, "granular-box")
