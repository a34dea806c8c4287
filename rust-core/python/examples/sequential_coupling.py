#!/usr/bin/env python3
"""Sequential coupling: concrete breaks as particles; at twelve points of the test, a damage-plastic element takes over.

The study of Stránský 2018, section 6.3: 1,000 spheres in a periodic cell, two copies on each other, compressed at 4 1/s; unloading at
half the speed. Each hand-over gives the stress and damage of the particles to one material point, which continues in simple
compression. Then the state at the peak goes to a mesh of hexahedra, element by element, which compresses further.

Writes into the folder `--output`: curves.png, sequential.json, sequential.html, and series of VTK files of particles (particles-*.vtu) and elements
(elements-*.vtu). Takes a minute.

    python3 sequential_coupling.py --output results --formulas printed
"""

import argparse
import json
from pathlib import Path

import concordem
import numpy as np
from concordem import coupling
from concordem.operators import Region

RADIUS, SIDE, HEIGHT, LAYER = 1e-3, 18.86e-3, 37.72e-3, 4e-3
RATE = 2.0
# Steps of loading, steps of unloading; his stress at the hand-over, MPa, and the damage of the coded formulas.
CASES = [
    (500, 0, -14.27, 0.0), (1000, 0, -25.87, 0.0), (1500, 0, -34.42, 0.0), (2000, 0, -39.33, 0.00639), (2500, 0, None, 0.107),
    (3000, 0, -22.55, 0.4253), (3500, 0, -12.22, 0.7056), (1500, 2000, -10.88, 0.0), (2000, 2000, None, None), (2500, 2000, -6.16, 0.3069),
    (3000, 1350, -3.35, 0.6546), (3500, 900, -2.11, 0.7888),
]
# His curves, MPa at strains of -0.5, -1, ... -3 e-3.
PUBLISHED = {"strain": [-5e-4, -1e-3, -1.5e-3, -2e-3, -2.5e-3, -3e-3],
             "cpm": [-16.6, -29.4, -37.9, -36.8, -23.3, -11.5], "dpm": [-16.2, -30.0, -37.6, -39.9, -25.2, -11.2]}


def scenario():
    """The specimen: ends move along z and do not rotate; sides are free."""
    ends = [{"name": name, "selection": {"kind": "layer", "axis": "z", "end": end, "thickness": LAYER}}
            for name, end in [("bottom", "minimum"), ("top", "maximum")]]
    speed = RATE * HEIGHT
    return concordem.Scenario(
        kinematics="yade-ratcheting",
        packing={"kind": "random-dense", "count": 1000, "radius": RADIUS, "seed": 1, "friction": 0.0, "protocol": "yade",
                 "shape": {"kind": "box", "size": [SIDE, SIDE, HEIGHT], "keep": "centers"}},
        material={"name": "concrete", "density": 4800.0, "cpm": {
            "mode": "thesis", "young": 27e9, "shear_ratio": 0.2, "crack_onset_strain": 0.98e-4, "relative_ductility": 30,
            "cohesion": 3e6, "friction_coefficient": 1.2}},
        bonds={"law": "cpm", "interaction_ratio": 1.5}, contacts={"law": "cpm"},
        integration={"time_step": 2.108e-7, "damping": {"kind": "local", "coefficient": 0.3}},
        set=ends,
        prescribe=[{"set": name, "velocity": ["free", "free", sign * speed], "angular_velocity": [0.0, 0.0, 0.0]}
                   for name, sign in [("bottom", 1.0), ("top", -1.0)]],
        stop={"steps": 100_000},
    )


class Specimen:
    """The particles, with strain and stress of the middle."""

    def __init__(self):
        self.simulation = scenario().simulation()
        state = self.simulation.state
        z = state.positions[:, 2].copy()
        # The sets count from the surface of the spheres.
        self.low, self.high = z < z.min() + LAYER - RADIUS, z > z.max() - LAYER + RADIUS
        self.area = float(np.prod([np.ptp(state.positions[:, i]) + 2 * RADIUS for i in (0, 1)]))
        self.start = self.length()
        velocities = state.writable("velocities")
        velocities[:, 2] = -2 * RATE * (z - 0.5 * (z.min() + z.max()))
        velocities[self.low, 2], velocities[self.high, 2] = RATE * HEIGHT, -RATE * HEIGHT

    def length(self):
        z = self.simulation.state.positions[:, 2]
        return z[self.high].mean() - z[self.low].mean()

    def strain(self):
        """Motion of the rigid ends over the height, as published."""
        return (self.length() - self.start) / HEIGHT

    def box(self):
        """The middle between the ends, and its volume within the specimen."""
        z = self.simulation.state.positions[:, 2]
        low, high = z[self.low].max(), z[self.high].min()
        return Region.box([-1.0, -1.0, low], [1.0, 1.0, high]), self.area * (high - low)

    def hand_over(self, law, size, formulas):
        region, volume = self.box()
        return coupling.hand_over(self.simulation, law, [region], size, formulas, [volume])

    def unload(self):
        """Turn the ends around, at half their speed."""
        state = self.simulation.state
        velocities = state.velocities.copy()
        velocities[self.low, 2], velocities[self.high, 2] = -0.5 * RATE * HEIGHT, 0.5 * RATE * HEIGHT
        self.simulation.set_motion(velocities, np.zeros_like(velocities))


def compress(law, state, size, end, steps):
    """Continue a material point in simple compression along z from its state; returns strains and stresses."""
    strain, curve = np.zeros((1, 3, 3)), []
    for k in range(steps + 1):
        strain[0, 2, 2] = end * k / steps
        for _ in range(50):
            update = law.update(strain, state, size)
            residual = np.array([update.stress[0, 0, 0], update.stress[0, 1, 1], update.stress[0, 0, 1], update.stress[0, 1, 2],
                                 update.stress[0, 2, 0]])
            # A millionth of the tensile strength.
            if np.abs(residual).max() < 1.0:
                break
            free = [0, 1, 5, 3, 4]
            change = np.linalg.solve(update.tangent[0][np.ix_(free, free)], residual)
            strain[0, 0, 0] -= change[0]
            strain[0, 1, 1] -= change[1]
            for (i, j), value in zip([(0, 1), (1, 2), (2, 0)], change[2:]):
                strain[0, i, j] -= value / 2
                strain[0, j, i] = strain[0, i, j]
        else:
            raise SystemExit(f"no equilibrium at strain {strain[0, 2, 2]:e}")
        state = update.state
        curve.append((strain[0, 2, 2], update.stress[0, 2, 2]))
    return np.array(curve)


def continue_as_elements(specimen, law, formulas, folder):
    """Hand the specimen over to a mesh, element by element, and compress it further."""
    import skfem

    positions = specimen.simulation.state.positions
    low, high = positions.min(axis=0) - RADIUS, positions.max(axis=0) + RADIUS
    lines = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, (2, 2, 4))]
    mesh = skfem.MeshHex.init_tensor(*lines)
    centers = mesh.p[:, mesh.t].mean(axis=1).T
    half = (high - low) / [4, 4, 8]
    given = coupling.hand_over(specimen.simulation, law, [Region.box(c - half, c + half) for c in centers], float(np.cbrt(8 * half.prod())),
                               formulas)
    material = coupling.Damaging(law, 4800.0 * 0.62, np.repeat(given.states, 8, axis=0))
    ends = np.isclose(mesh.p[2], low[2]) | np.isclose(mesh.p[2], high[2])
    fixed = np.zeros((mesh.p.shape[1], 3), dtype=bool)
    fixed[ends, 2] = True
    elements = coupling.ScikitDynamics(mesh, material, safety=0.5, damping=2e4, fixed=fixed)
    elements.prescribed[:, 2] = np.where(mesh.p[2] > 0.5 * (low[2] + high[2]), -1, 1) * RATE * HEIGHT
    elements.velocity[:, 2] = -2 * RATE * (mesh.p[2] - 0.5 * (low[2] + high[2]))
    order = [6, 2, 0, 3, 7, 4, 1, 5]
    steps = int(2e-3 / (2 * RATE) / elements.time_step)
    for k in range(steps + 1):
        if k % max(1, steps // 8) == 0:
            coupling.write_vtk(folder / f"elements-{k:05d}.vtu", mesh.p.T + elements.displacement, mesh.t.T[:, order], "hexahedron",
                               {"displacement": elements.displacement}, {"damage": material.damage.reshape(-1, 8).mean(axis=1)})
        elements.step()
    return float(abs(elements.balance) / abs(elements.internal_work)), float(material.damage.max())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("sequential"))
    parser.add_argument("--formulas", choices=["printed", "coded"], default="printed")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    law, size = coupling.DamagePlastic(33e9, 0.2, 40e6, 1e6, 100.0, softening_ductility=6.0), 2.0

    specimen = Specimen()
    radii = specimen.simulation.state.radii.copy()
    curve, saved, branches = [], {}, {}
    loads = sorted({case[0] for case in CASES})
    peak = (0.0, None)
    for step in range(0, 4001, 20):
        # Stress of the middle and strain of the ends, at the same step.
        region, volume = specimen.box()
        forces = specimen.simulation.forces()
        stress = concordem.operators.region_stress(specimen.simulation.state.positions, forces.contacts, region).stress[2, 2]
        curve.append((specimen.strain(), stress * region.volume / volume))
        if step in loads:
            specimen.simulation.save(options.output / f"state-{step}.h5")
            saved[step] = specimen.strain(), specimen.hand_over(law, size, options.formulas), specimen.hand_over(law, size, "coded")
        if step % 400 == 0:
            bonds = specimen.simulation.bonds()
            lost = np.zeros(len(radii))
            for column in (0, 1):
                np.add.at(lost, bonds.pair[:, column], bonds.lost_strength)
            number = np.bincount(bonds.pair.ravel(), minlength=len(radii))
            coupling.write_vtk(options.output / f"particles-{step:05d}.vtu", specimen.simulation.state.positions,
                               point_data={"radius": radii, "lost_strength": lost / np.maximum(number, 1)})
        if step == 2000:
            elements = continue_as_elements(specimen, law, options.formulas, options.output)
        specimen.simulation.step(20)
    curve = np.array(curve)
    for load in sorted({case[0] for case in CASES if case[1]}):
        branch = Specimen()
        branch.simulation = concordem.Simulation.load(options.output / f"state-{load}.h5")
        branch.start = specimen.start
        branch.unload()
        done = 0
        for unload in sorted({case[1] for case in CASES if case[0] == load and case[1]}):
            branch.simulation.step(unload - done)
            done = unload
            branches[load, unload] = branch.strain(), branch.hand_over(law, size, options.formulas), branch.hand_over(law, size, "coded")

    rows, curves = [], []
    for load, unload, published, damage in CASES:
        strain, given, coded = branches[load, unload] if unload else saved[load]
        continued = compress(law, given.states, size, -4e-3, 400)
        curves.append((strain, continued))
        rows.append({
            "steps": load, "unloading": unload, "strain": strain, "stress": given.stress[0, 2, 2], "published_stress": published and published * 1e6,
            "damage_tensor": sorted(np.linalg.eigvalsh(given.damage_tensor[0]).tolist(), reverse=True), "damage": given.damage[0],
            "coded_damage": coded.damage[0], "published_damage": damage, "hardening": given.states[0, 6], "bonds": int(given.bonds[0]),
            "start_stress": continued[0, 1], "peak_stress": continued[:, 1].min(),
        })
    whole = compress(law, np.zeros((1, 8)), size, -4e-3, 400)
    at = lambda data, strain: float(np.interp(-strain, -data[:, 0], data[:, 1]))
    result = {
        "formulas": options.formulas, "cpm": {"peak": float(curve[:, 1].min()), "peak_strain": float(curve[curve[:, 1].argmin(), 0]),
                                              "modulus": float(at(curve, -2e-4) / -2e-4), "stress": [at(curve, e) for e in PUBLISHED["strain"]]},
        "dpm": {"peak": float(whole[:, 1].min()), "peak_strain": float(whole[whole[:, 1].argmin(), 0]),
                "stress": [at(whole, e) for e in PUBLISHED["strain"]]},
        "published": PUBLISHED, "hand_overs": rows, "mesh": {"balance": elements[0], "largest_damage": elements[1]},
    }
    (options.output / "sequential.json").write_text(json.dumps(result, indent=1) + "\n")
    print(f"CPM: peak {result['cpm']['peak'] / 1e6:.2f} MPa at {result['cpm']['peak_strain'] * 1e3:.3f}e-3 (published -39.6 at -1.75e-3)")
    print(f"DPM: peak {result['dpm']['peak'] / 1e6:.2f} MPa at {result['dpm']['peak_strain'] * 1e3:.3f}e-3 (published -40.0 at -2.275e-3)")
    print("steps unload  stress MPa (published)  damage coded (published)  kappa_P  start MPa  peak MPa")
    for row in rows:
        shown = "" if row["published_stress"] is None else f"{row['published_stress'] / 1e6:.2f}"
        print(f"{row['steps']:5d} {row['unloading']:6d}  {row['stress'] / 1e6:10.2f} ({shown:>6})  {row['damage']:.4f} {row['coded_damage']:.4f} "
              f"({row['published_damage']})  {row['hardening']:.3f}  {row['start_stress'] / 1e6:8.2f}  {row['peak_stress'] / 1e6:8.2f}")

    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7, 4.5), layout="constrained")
    axes.plot(-curve[:, 0] * 1e3, -curve[:, 1] / 1e6, "k", lw=2, label="particles (CPM)")
    axes.plot(-whole[:, 0] * 1e3, -whole[:, 1] / 1e6, "#0072B2", lw=2, label="continuum (DPM)")
    axes.plot(-np.array(PUBLISHED["strain"]) * 1e3, -np.array(PUBLISHED["cpm"]), "ko", mfc="w", label="Stránský 2018, CPM")
    axes.plot(-np.array(PUBLISHED["strain"]) * 1e3, -np.array(PUBLISHED["dpm"]), "s", color="#0072B2", mfc="w", label="Stránský 2018, DPM")
    shades = matplotlib.colormaps["viridis"](np.linspace(0.25, 0.95, len(curves)))
    for k, ((strain, continued), shade) in enumerate(zip(curves, shades)):
        way = -(continued[:, 0] + strain) * 1e3, -continued[:, 1] / 1e6
        axes.plot(*way, color=shade, lw=0.9, label="continued by an element (light: later)" if k == len(curves) // 2 else None)
        axes.plot(way[0][0], way[1][0], "o", color=shade, ms=5)
    axes.set(xlabel="compressive strain, 10⁻³", ylabel="stress, MPa", xlim=(0, 5), ylim=(0, None))
    axes.legend(frameon=False, fontsize=9)
    figure.savefig(options.output / "curves.png", dpi=130)
    difference = max(abs(row["start_stress"] / row["stress"] - 1) for row in rows)
    coupling.write_page(
        options.output / "sequential.html", "Concrete breaks as particles, and goes on as a continuum",
        "Particles are compressed; at twelve points of the test, a damage-plastic element takes over stress and damage. The study of Stránský 2018, "
        "section 6.3.", options.output / "curves.png",
        [("largest change of the axial stress by a hand-over, over it", difference, "1"),
         ("residual of the ledger of the elements that go on, over the internal work", elements[0], "1")],
        [("peak of the particles (published 39.6)", -result["cpm"]["peak"] / 1e6, "MPa"),
         ("peak of the continuum (published 40.0)", -result["dpm"]["peak"] / 1e6, "MPa"),
         ("largest damage of an element at the end", elements[1], "1")],
        ["sequential.json", "particles-*.vtu", "elements-*.vtu"],
    )


if __name__ == "__main__":
    main()
