#!/usr/bin/env python3
"""Volume coupling: what a wave loses at the interface of elements and particles, against the width of the overlap and damping.

A bar of bricks continues as a chain of bonded particles of the same stiffness and mass per length; the first particle is a slave in the bar.
The bar ends `overlap` (e) behind the slave. A packet of waves of length L, wave number k, runs from the bar into the chain. Theory of a
continuous bar with the impedance Z = m c/d: the slave carries no mass, so half of a particle, m/2, is missing at its place; and the end of
the bar behind it answers as Z tan(k e). Together they reflect the share x^2/(1 + x^2) of the energy, x = (tan(k e) - k d/2)/2.

Writes overlap.png, overlap.json, and overlap.html into the folder `--output`. Takes half a minute.

    python3 wave_overlap.py --output results
"""

import argparse
import json
from pathlib import Path

import concordem
import numpy as np
from concordem import coupling

SPACING, STIFFNESS, DENSITY = 0.01, 1e5, 2000.0
MASS = DENSITY * SPACING**3
SPEED = SPACING * np.sqrt(STIFFNESS / MASS)
FINENESS = 2


def reflected(overlap, length, damping=0.0):
    """Share of the energy that comes back.

    Args: `overlap` behind the slave and wavelength `length`, both in spacings; mass-proportional `damping` of the elements, over the
    frequency of the wave. Returns reflected and transmitted energy over that of the packet at the start, and the theory.
    """
    import skfem

    fine = SPACING / FINENESS
    step = 0.25 * fine / SPEED
    # A packet of some 4 waves in the bar, and place for it in the chain.
    width = length * SPACING
    bar = 7 * width
    bricks = round(bar / fine)
    line = fine * np.arange(-bricks, round(overlap * FINENESS) + 1)
    side = np.array([-0.5, 0.5]) * SPACING
    wave = 2 * np.pi / (length * SPACING)
    elements = coupling.ScikitDynamics(
        skfem.MeshHex.init_tensor(line, side, side), coupling.Elastic(STIFFNESS / SPACING, 0.0, DENSITY), step, damping=damping * wave * SPEED,
    )
    x = elements.nodes[:, 0]

    def shape(s):
        """The packet in the middle of the bar."""
        return 1e-5 * SPACING * np.cos(wave * (s + 0.5 * bar)) * np.exp(-0.5 * ((s + 0.5 * bar) / width) ** 2)

    count = round(7 * width / SPACING)
    simulation = concordem.Scenario(
        packing={"kind": "spheres", "spheres": [[k * SPACING, 0, 0, 0.5 * SPACING] for k in range(count + 1)]},
        material={"name": "m", "density": DENSITY * 6 / np.pi, "linear_bond": {"normal_stiffness": STIFFNESS, "shear_stiffness": 0.0}},
        bonds={"law": "linear_bond", "interaction_ratio": 1.01}, contacts={"law": "none"},
        set=[{"name": "slave", "selection": {"kind": "ids", "ids": [0]}}],
        prescribe=[{"set": "slave", "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0]}],
        integration={"time_step": step}, output={"sample_interval": 1}, stop={"steps": 10**9},
    ).simulation(threads=1)
    # The coupling begins with elements without deformation; the packet is far away from the slave.
    volume = coupling.VolumeCoupling(simulation, elements, [0])
    # It runs to the right; velocities are those half a step before.
    elements.displacement[:, 0] = shape(x)
    elements.velocity[:, 0] = (shape(x) - shape(x + SPEED * step)) / step
    start = elements.kinetic_energy + elements.stored_energy()
    # The packet has left the bar, and has not come back from the end of the chain.
    volume.step(round(bar / (SPEED * step)))
    back = elements.kinetic_energy + elements.stored_energy()
    state, last = simulation.state, simulation.samples[-1]
    free = state.ids != 0
    beyond = 0.5 * float(state.masses[free] @ (state.velocities[free] ** 2).sum(axis=1)) + float(last["stored_normal"])
    return back / start, beyond / start, theory(overlap, length)


def theory(overlap, length):
    """Reflected share of the energy of long waves."""
    x = 0.5 * (np.tan(2 * np.pi * overlap / length) - np.pi / length)
    return x**2 / (1 + x**2)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("overlap"))
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    result = {"overlap": [], "damping": []}
    for length in (6, 10, 20):
        for overlap in (0.0, 0.5, 1.0, 2.0):
            back, beyond, expected = reflected(overlap, length)
            result["overlap"].append({"wavelength": length, "overlap": overlap, "reflected": back, "transmitted": beyond, "theory": expected})
            print(result["overlap"][-1], flush=True)
    for damping in (0.01, 0.03, 0.1):
        back, beyond, _ = reflected(0.0, 10, damping)
        result["damping"].append({"damping": damping, "reflected": back, "transmitted": beyond})
        print(result["damping"][-1], flush=True)
    (options.output / "overlap.json").write_text(json.dumps(result, indent=1) + "\n")
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axis = pyplot.subplots(figsize=(6, 4), layout="constrained")
    e = np.linspace(0, 2, 201)
    # Colors that color-blind readers tell apart (Okabe and Ito), and a mark and a line style for each length.
    for length, color, mark, style in (6, "#0072B2", "o", "-"), (10, "#D55E00", "s", "--"), (20, "#009E73", "^", ":"):
        rows = [row for row in result["overlap"] if row["wavelength"] == length]
        axis.semilogy([row["overlap"] for row in rows], [row["reflected"] for row in rows], mark, color=color, label=f"wavelength {length} d")
        axis.semilogy(e, theory(e, length), style, color=color, linewidth=1)
    axis.set(xlabel="overlap behind the slave, spacings d", ylabel="reflected share of the energy (lines: theory)", ylim=(1e-7, 1))
    axis.legend(frameon=False)
    figure.savefig(options.output / "overlap.png", dpi=110)
    shown = [row for row in result["overlap"] if row["wavelength"] == 10]
    coupling.write_page(
        options.output / "overlap.html", "A wave through the overlap of elements and particles",
        "A packet of waves runs from a bar of finite elements into a chain of particles. The elements end at the overlap behind the slave.",
        options.output / "overlap.png",
        [("largest energy that is neither reflected nor transmitted, over that of the packet",
          max(abs(1 - row["reflected"] - row["transmitted"]) for row in result["overlap"]), "1")],
        [(f"reflected at an overlap of {row['overlap']} spacings, waves of 10 (theory {row['theory']:.2g})", row["reflected"], "1") for row in shown]
        + [(f"reflected with a damping of {row['damping']} of the frequency", row["reflected"], "1") for row in result["damping"]],
        ["overlap.json"],
    )


if __name__ == "__main__":
    main()
