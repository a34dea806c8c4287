#!/usr/bin/env python3
"""Surface coupling: spheres hit a cantilever of finite elements and touch it outside its original outline.

The set-up of Stránský 2018, section 5.1 (surf1): a beam of 1 x 1 x 5 m, its base fixed, of 3 x 3 x 15 bricks with large displacements,
E = 5 MPa, nu = 0.2, 2,000 kg/m^3, mass-proportional damping 0.1 1/s; three spheres of 0.48 m and 3,000 kg/m^3. The first one hits the
tip and bends the beam; the beam then touches the third, at rest beside it, and the second comes along the bent beam. Both touch only the beam
that has moved: with a skin that stays behind they would pass by.

Two things differ from his set-up. Time steps of 1 ms in place of 5 ms, just below the stable step of his elements, 5.16 ms; and a contact
modulus of 1 MPa in place of 0.1 MPa, with which the first sphere passes through the beam.

Writes surface.png, surface.json, surface.html, and series of VTK files of beam (beam-*.vtu) and spheres (spheres-*.vtu) into the folder `--output`.
Takes some 20 seconds.

    python3 surface_beam.py --output results
"""

import argparse
import json
import time
from pathlib import Path

import concordem
import numpy as np
from concordem import coupling

STEP, TIME = 1e-3, 1.5
SPHERES = [([-1.0, 0.5, 4.5], [6.0, 0.0, 0.0]), ([1.5, -3.2, 4.0], [0.0, 5.0, 0.0]), ([1.5, 1.6, 4.0], [0.0, 0.0, 0.0])]
RADIUS, MODULUS = 0.48, 1e6


def beam():
    import skfem

    mesh = skfem.MeshHex.init_tensor(np.linspace(0, 1, 4), np.linspace(0, 1, 4), np.linspace(0, 5, 16))
    return coupling.ScikitDynamics(mesh, coupling.Elastic(5e6, 0.2, 2000.0), STEP, damping=0.1, fixed=mesh.p[2] == 0)


def spheres(skin):
    names = [f"sphere {k}" for k in range(len(SPHERES))]
    return concordem.Scenario(
        packing={"kind": "spheres", "spheres": [[*place, RADIUS] for place, _ in SPHERES]},
        material={"name": "rubber", "density": 3000.0, "frictional": {
            "young": MODULUS, "stiffness_ratio": 0.3, "friction_coefficient": 0.5}},
        contacts={"law": "frictional"},
        wall=[skin.wall("skin", "rubber")],
        set=[{"name": name, "selection": {"kind": "ids", "ids": [k]}} for k, name in enumerate(names)],
        initial=[{"set": name, "velocity": velocity} for name, (_, velocity) in zip(names, SPHERES)],
        integration={"time_step": STEP}, output={"sample_interval": 1}, stop={"steps": 10**9},
    )


def run(follow=True, folder=None):
    """The run; `follow`: whether the skin moves with the elements. Returns the series."""
    elements = beam()
    skin = coupling.Skin(elements)
    simulation = spheres(skin).simulation()
    surface = coupling.SurfaceCoupling(simulation, elements, skin)
    order = [6, 2, 0, 3, 7, 4, 1, 5]
    tip = np.nonzero(elements.nodes[:, 2] == 5)[0]
    rows = {name: [] for name in ("time", "tip", "force", "reach", "kinetic", "elements", "work", "drift", "balance", "residual")}
    rows["place"], rows["on_spheres"] = [], []
    moving = simulation.state.masses @ simulation.state.velocities
    steps = round(TIME / STEP)
    for k in range(steps):
        if follow:
            surface.step()
        else:
            # The author's module in the extreme: the forces reach the elements, the skin stays.
            simulation.step()
            force = np.zeros_like(elements.nodes)
            force[skin.nodes] = simulation.mesh("skin").forces
            elements.step(force)
        state = simulation.state
        walls = simulation.forces().walls
        on = np.zeros((len(state), 3))
        np.add.at(on, walls.particle, walls.force)
        # Contacts beyond the original outline of the beam.
        outside = (walls.point[:, 0] > 1.001) & (np.linalg.norm(walls.force, axis=1) > 0)
        rows["time"].append((k + 1) * STEP)
        rows["tip"].append(elements.displacement[tip].mean(axis=0).tolist())
        rows["force"].append(np.linalg.norm(on, axis=1)[np.argsort(state.ids)].tolist())
        rows["reach"].append(float(walls.point[outside, 0].max()) if outside.any() else 0.0)
        rows["place"].append(state.positions[np.argsort(state.ids)].tolist())
        rows["kinetic"].append(0.5 * float(state.masses @ (state.velocities**2).sum(axis=1)))
        rows["elements"].append(elements.kinetic_energy + elements.internal_work)
        rows["work"].append(surface.work)
        lost = moving - state.masses @ state.velocities - surface.impulse
        rows["drift"].append(float(np.abs(lost).max() / np.abs(moving).max()))
        rows["balance"].append(elements.balance)
        rows["residual"].append(float(simulation.samples["residual"][-1]) if k % 100 == 99 else 0.0)
        if folder is not None and k % 50 == 0:
            coupling.write_vtk(folder / f"beam-{k:05d}.vtu", elements.nodes + elements.displacement, elements.mesh.t.T[:, order],
                               "hexahedron", {"displacement": elements.displacement, "velocity": elements.velocity})
            coupling.write_vtk(folder / f"spheres-{k:05d}.vtu", state.positions, None, "vertex",
                               {"velocity": state.velocities, "radius": state.radii, "force": on})
        if folder is not None and k in (0, 250, 500, 1000):
            rows.setdefault("shapes", []).append((k * STEP, (elements.nodes + elements.displacement).copy(), state.positions[np.argsort(state.ids)]))
    return rows, elements, skin


def picture(path, rows, elements, stale):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    # Colors that color-blind readers tell apart (Okabe and Ito), and a line style for each.
    colors, styles = ["#0072B2", "#E69F00", "#009E73"], ["-", "--", "-."]
    figure, axes = pyplot.subplots(2, 3, figsize=(11, 8), layout="constrained")
    edges = {tuple(sorted(edge)) for cell in elements.mesh.t.T for edge in
             [(cell[a], cell[b]) for a, b in [(0, 1), (0, 2), (0, 3), (1, 4), (1, 5), (2, 4), (2, 6), (3, 5), (3, 6), (4, 7), (5, 7), (6, 7)]]}
    for axis, (moment, nodes, centers) in zip(axes[0], [rows["shapes"][at] for at in (0, 1, 3)]):
        for a, b in edges:
            axis.plot(nodes[[a, b], 0], nodes[[a, b], 2], color="0.6", linewidth=0.4)
        axis.plot([0, 0, 1, 1], [0, 5, 5, 0], "k:", linewidth=1)
        for k, center in enumerate(centers):
            axis.add_patch(pyplot.Circle(center[[0, 2]], RADIUS, color=colors[k], alpha=0.6, label=f"sphere {k + 1}"))
        axis.set(xlim=(-1.8, 4.2), ylim=(0, 6), aspect="equal", title=f"t = {moment:.2f} s", xlabel="x, m")
    axes[0][0].legend(frameon=False, fontsize=9, loc="upper right")
    axes[0][0].set_ylabel("z, m (dotted: beam at the start)")
    t = np.array(rows["time"])
    axes[1][0].plot(t, np.array(rows["tip"])[:, 0], color=colors[0])
    axes[1][0].set(xlabel="time, s", ylabel="displacement of the tip along x, m")
    for k in range(3):
        axes[1][1].plot(t, np.array(rows["force"])[:, k] / 1e3, color=colors[k], linestyle=styles[k], label=f"sphere {k + 1}")
        axes[1][1].plot(t, np.array(stale["force"])[:, k] / 1e3, ":", color="0.6", linewidth=1, label=None if k else "skin stays behind")
    axes[1][1].set(xlabel="time, s", ylabel="force of the skin on a sphere, kN")
    axes[1][1].legend(frameon=False)
    names = [("kinetic", "spheres, kinetic"), ("elements", "beam, kinetic and internal"), ("work", "work through the skin")]
    for color, style, (name, label) in zip(colors, styles, names):
        axes[1][2].plot(t, np.array(rows[name]) / 1e3, color=color, linestyle=style, label=label)
    axes[1][2].set(xlabel="time, s", ylabel="energy, kJ")
    axes[1][2].legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("surface"))
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    rows, elements, skin = run(folder=options.output)
    seconds = (time.perf_counter() - begin) / len(rows["time"])
    stale, *_ = run(follow=False)
    force, old = np.array(rows["force"]), np.array(stale["force"])
    result = {
        "vertices": len(skin.nodes), "triangles": len(skin.triangles), "seconds_per_step": seconds,
        "largest_tip_displacement": float(np.max(np.linalg.norm(rows["tip"], axis=1))),
        "largest_force": force.max(axis=0).tolist(), "largest_force_if_the_skin_stays": old.max(axis=0).tolist(),
        "farthest_contact_x": max(rows["reach"]), "lost_momentum": max(rows["drift"]),
        "largest_balance": float(np.abs(rows["balance"]).max()), "largest_residual": float(np.abs(rows["residual"]).max()),
        "work": rows["work"][-1],
    }
    (options.output / "surface.json").write_text(json.dumps(result, indent=1) + "\n")
    for name, value in result.items():
        print(f"{name}: {value}")
    picture(options.output / "surface.png", rows, elements, stale)
    coupling.write_page(
        options.output / "surface.html", "Spheres hit a beam", "Three spheres hit a beam of finite elements and touch it outside its original outline, "
        "in the set-up of Stránský 2018, section 5.1.", options.output / "surface.png",
        [("work through the skin on the beam", result["work"], "J"), ("momentum lost, over that of the spheres", result["lost_momentum"], "1"),
         ("largest residual of the ledger of the elements", result["largest_balance"], "J"),
         ("largest residual of the ledger of the particles", result["largest_residual"], "J")],
        [("largest displacement of the tip", result["largest_tip_displacement"], "m"), ("farthest contact, x", result["farthest_contact_x"], "m"),
         ("time per step", 1e3 * seconds, "ms")],
        ["surface.json", "beam-*.vtu", "spheres-*.vtu"],
    )


if __name__ == "__main__":
    main()
