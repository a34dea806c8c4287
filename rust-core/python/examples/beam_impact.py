#!/usr/bin/env python3
"""Volume coupling: an impactor hits the middle of a beam, which is particles between two parts of elements.

The set-up of Stransky 2018, section 5.2 (vol1): a beam of 1.0 x 0.12 x 0.01 m in plane stress, 25 x 3 bricks without the five middle
columns, E = 1 GPa, nu = 0.2, 2,000 kg/m^3, both ends fixed. In the middle, hexagonal rows of particles of 5 mm over 0.26 x 0.12 m, which
move in the plane: CPM with E = 1 GPa, crack onset strain 3e-3, cohesion 100 MPa, no friction, relative ductility 100, interaction ratio
1.5, 3,000 kg/m^3, damping 0.1. A clump of ten spheres, with three times its mass and 15 times its inertia, hits it at 50 m/s. 2,000
steps of 2 us.

Plane stress: bricks one layer thick whose nodes do not move across the plane, with the condensed stiffness of plane stress.

The source leaves open the place and the shape of the impactor (here two rows of five, above the middle), and the friction of later
contacts (here 0.5). His module passes the forces one step late. It publishes no figures of this run.

Writes impact.png, impact.json, impact.html, and series of VTK files of elements (elements-*.vtu) and particles (particles-*.vtu) into the
folder `--output`. Takes some seconds.

    python3 beam_impact.py --output results
"""

import argparse
import json
import time
from pathlib import Path

import concordem
import numpy as np
from concordem import coupling

STEP, STEPS = 2e-6, 2000
RADIUS, HEIGHT, THICKNESS = 5e-3, 0.12, 0.01
YOUNG, POISSON = 1e9, 0.2
SPEED = 50.0


def plane_stress():
    """Stiffness (Pa, (6, 6)) of a layer in plane stress: nothing couples to the strain across, whose own modulus has no effect."""
    matrix = np.diag([0.0, 0.0, YOUNG, *[0.5 * YOUNG / (1 + POISSON)] * 3])
    matrix[:2, :2] = YOUNG / (1 - POISSON**2) * np.array([[1, POISSON], [POISSON, 1]])
    return matrix


def beam(held=True):
    """The two parts of the beam, without the five middle columns; `held`: whether its ends are fixed."""
    import skfem

    mesh = skfem.MeshHex.init_tensor(np.linspace(-0.5, 0.5, 26), np.linspace(-0.06, 0.06, 4), [-0.5 * THICKNESS, 0.5 * THICKNESS])
    mesh = mesh.remove_elements(np.nonzero(np.abs(mesh.p[0, mesh.t].mean(axis=0)) < 0.1 - 1e-9)[0])
    fixed = np.zeros((mesh.p.shape[1], 3), dtype=bool)
    fixed[:, 2] = True
    fixed[np.isclose(np.abs(mesh.p[0]), 0.5)] |= held
    return coupling.ScikitDynamics(mesh, coupling.Elastic(stiffness=plane_stress(), density=2000.0), STEP, fixed=fixed)


def rows():
    """Hexagonal rows, (n, 4), symmetric about the middle of the beam."""
    lift = np.sqrt(3.0) * RADIUS
    levels = int((HEIGHT - 2 * RADIUS) / lift) + 1
    spheres = []
    for k in range(levels):
        count = 26 - k % 2
        y = (k - 0.5 * (levels - 1)) * lift
        spheres += [[(i - 0.5 * (count - 1)) * 2 * RADIUS, y, 0.0, RADIUS] for i in range(count)]
    return np.array(spheres)


def impactor(top):
    """Two rows of five spheres that touch, so far above `top` (m) that they are not bonded to the beam."""
    lift = np.sqrt(3.0) * RADIUS
    return [[(i - 2) * 2 * RADIUS + 0.5 * RADIUS * (-1) ** k, top + 3.1 * RADIUS + k * lift, 0.0, RADIUS] for k in range(2) for i in range(5)]


def particles(threads=None, damping=0.1):
    """The simulation, and the ids of the slaves: particles whose centers lie in the elements."""
    spheres = rows()
    slaves = np.nonzero(np.abs(spheres[:, 0]) > 0.1 - 1e-9)[0].tolist()
    free = np.setdiff1d(np.arange(len(spheres)), slaves).tolist()
    hammer = impactor(spheres[:, 1].max())
    density = 3000.0
    mass = 10 * density * 4 / 3 * np.pi * RADIUS**3
    arms = np.array(hammer)[:, :3] - np.mean(hammer, axis=0)[:3]
    # Of the spheres about their common center, in ascending order: about x, y, and z.
    own = 0.4 * RADIUS**2
    inertia = sorted(mass * (np.mean((arms**2).sum(axis=1) - arms[:, axis] ** 2) + own) for axis in range(3))
    scenario = concordem.Scenario(
        packing={"kind": "spheres", "spheres": spheres.tolist()},
        material={"name": "m", "density": density, "cpm": {
            "young": 1e9, "shear_ratio": 0.2, "crack_onset_strain": 3e-3, "relative_ductility": 100, "cohesion": 1e8, "friction_coefficient": 0.0},
            "frictional": {"young": 1e9, "stiffness_ratio": 0.2, "friction_coefficient": 0.5}},
        bonds={"law": "cpm", "interaction_ratio": 1.5}, contacts={"law": "frictional"},
        clump=[{"spheres": hammer, "mass": 3 * mass, "inertia": [15 * i for i in inertia], "velocity": [0.0, -SPEED, 0.0]}],
        set=[{"name": "slaves", "selection": {"kind": "ids", "ids": slaves}}, {"name": "free", "selection": {"kind": "ids", "ids": free}}],
        prescribe=[{"set": "slaves", "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0]},
                   {"set": "free", "velocity": ["free", "free", 0], "angular_velocity": [0, 0, "free"]}],
        integration={"time_step": STEP, "damping": {"kind": "local", "coefficient": damping}},
        output={"sample_interval": 1}, stop={"steps": 10**9},
    )
    return scenario.simulation(threads=threads), slaves


def run(steps=STEPS, folder=None, threads=None, every=10):
    """The run. Returns the series, with one entry in `every` steps, and the coupling."""
    elements = beam()
    simulation, slaves = particles(threads)
    volume = coupling.VolumeCoupling(simulation, elements, slaves)
    names = ("time", "impactor", "force", "kinetic", "elements", "work", "lost", "broken", "damaged", "residual", "balance", "momentum", "impulse")
    series = {name: [] for name in names}
    series["shapes"] = []
    first = len(rows())
    impulse, lost, largest = np.zeros(3), np.zeros(3), np.zeros(3)
    for k in range(steps):
        volume.step()
        last = volume.last
        impulse += STEP * last.force
        largest = np.maximum(largest, [np.abs(last.force).max(), np.abs(last.moment).max(), abs(last.work)])
        lost = np.maximum(lost, [np.abs(last.lost_force).max(), np.abs(last.lost_moment).max(), abs(last.lost_work)])
        if (k + 1) % every:
            continue
        state, sample = simulation.state, simulation.samples[-1]
        series["time"].append((k + 1) * STEP)
        series["impactor"].append(float(state.velocities[state.ids >= first, 1].mean()))
        series["force"].append(last.force.tolist())
        series["kinetic"].append(float(sample["kinetic"]))
        series["elements"].append(elements.kinetic_energy + elements.internal_work)
        series["work"].append(volume.work)
        series["lost"].append((lost / np.maximum(largest, 1e-300)).tolist())
        series["broken"].append(int(sample["broken"]))
        series["damaged"].append(int(sample["damaged"]))
        series["residual"].append(float(sample["residual"]))
        series["balance"].append(elements.balance)
        series["momentum"].append(elements.momentum().tolist())
        series["impulse"].append(impulse.tolist())
        if folder is not None and (k + 1) % 100 == 0:
            coupling.write_vtk(folder / f"elements-{k + 1:05d}.vtu", elements.nodes + elements.displacement,
                               elements.mesh.t.T[:, [6, 2, 0, 3, 7, 4, 1, 5]], "hexahedron",
                               {"displacement": elements.displacement, "velocity": elements.velocity})
            coupling.write_vtk(folder / f"particles-{k + 1:05d}.vtu", state.positions, None, "vertex",
                               {"velocity": state.velocities, "radius": state.radii, "slave": np.isin(state.ids, slaves).astype(float)})
        if k + 1 in (steps // 4, steps // 2, steps):
            series["shapes"].append(((k + 1) * STEP, (elements.nodes + elements.displacement).copy(), np.array(state.positions)))
    return series, volume


def picture(path, series, elements):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.collections import EllipseCollection, PolyCollection

    figure, axes = pyplot.subplot_mosaic([[f"t{k}"] * 3 for k in range(3)] + [["speed", "energy", "bonds"]], figsize=(10, 10), layout="constrained",
                                         height_ratios=[1, 1, 1, 1.6])
    # The four nodes of each brick in front, around it.
    front = np.array([sorted(brick[elements.nodes[brick, 2] > 0], key=lambda node: np.arctan2(*(elements.nodes[node] - middle)[:2]))
                      for brick in elements.mesh.t.T for middle in [elements.nodes[brick].mean(axis=0)]])
    for k, (moment, nodes, centers) in enumerate(series["shapes"]):
        axis = axes[f"t{k}"]
        axis.add_collection(PolyCollection(nodes[front][:, :, :2], facecolors="none", edgecolors="C0", linewidths=0.5))
        size = np.full(len(centers), 2 * RADIUS)
        axis.add_collection(EllipseCollection(size, size, np.zeros(len(centers)), units="xy", offsets=centers[:, :2], transOffset=axis.transData,
                                              facecolors="C1", edgecolors="k", linewidths=0.2))
        axis.set(xlim=(-0.52, 0.52), ylim=(-0.1, 0.15), aspect="equal", ylabel="y, m", title=f"t = {moment * 1e3:.1f} ms")
    t = np.array(series["time"]) * 1e3
    axes["speed"].plot(t, series["impactor"])
    axes["speed"].set(xlabel="time, ms", ylabel="velocity of the impactor, m/s")
    # The last two coincide.
    for name, line, label in [("kinetic", "-", "particles, kinetic"), ("elements", "-", "elements, kinetic + internal"),
                              ("work", "--", "work of the slaves on the elements")]:
        axes["energy"].plot(t, series[name], line, label=label)
    axes["energy"].set(xlabel="time, ms", ylabel="energy, J")
    axes["energy"].legend(frameon=False, fontsize=8)
    for name in ("damaged", "broken"):
        axes["bonds"].plot(t, series[name], label=name)
    axes["bonds"].set(xlabel="time, ms", ylabel="bonds")
    axes["bonds"].legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=90)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("impact"))
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    series, volume = run(folder=options.output)
    seconds = (time.perf_counter() - begin) / STEPS
    elements = volume.elements
    lost = series["lost"][-1]
    result = {
        "particles": len(volume.simulation.state), "slaves": len(volume.slaves), "elements": int(elements.mesh.t.shape[1]),
        "seconds_per_step": seconds, "impactor_velocity": series["impactor"][-1], "broken_bonds": series["broken"][-1],
        "damaged_bonds": series["damaged"][-1],
        "bonds": volume.simulation.summary.bonds, "work": series["work"][-1], "external_work": elements.external_work,
        "impulse": series["impulse"][-1], "lost_force": lost[0], "lost_moment": lost[1], "lost_work": lost[2],
        "kinetic_at_start": series["kinetic"][0], "largest_balance": float(np.abs(series["balance"]).max()),
        "largest_residual": float(np.abs(series["residual"]).max()),
    }
    (options.output / "impact.json").write_text(json.dumps(result, indent=1) + "\n")
    for name, value in result.items():
        print(f"{name}: {value}")
    picture(options.output / "impact.png", series, elements)
    coupling.write_page(
        options.output / "impact.html", "Beam under impact", "An impactor at 50 m/s hits the middle of a beam: particles between two parts of elements, "
        "in the set-up of Stránský 2018, section 5.2.", options.output / "impact.png",
        [("work of the slaves on the nodes", result["work"], "J"), ("external work in the ledger of the elements", result["external_work"], "J"),
         ("impulse along y, passed to the elements", result["impulse"][1], "N s"),
         ("largest loss of force in an exchange, over the largest force", lost[0], "1"), ("largest loss of moment, over the largest moment", lost[1], "1"),
         ("largest loss of work, over the largest work", lost[2], "1"),
         ("largest residual of the ledger of the elements", result["largest_balance"], "J"),
         ("largest residual of the ledger of the particles", result["largest_residual"], "J")],
        [("kinetic energy at the start", result["kinetic_at_start"], "J"), ("velocity of the impactor at the end", result["impactor_velocity"], "m/s"),
         ("broken bonds", result["broken_bonds"], f"of {result['bonds']}"), ("damaged bonds", result["damaged_bonds"], f"of {result['bonds']}"), ("time per step", 1e3 * seconds, "ms")],
        ["impact.json", "elements-*.vtu", "particles-*.vtu"],
    )


if __name__ == "__main__":
    main()
