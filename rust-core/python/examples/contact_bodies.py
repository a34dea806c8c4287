#!/usr/bin/env python3
"""Contact coupling: bodies of finite elements touch each other under the contact laws of the particles.

Three set-ups:

- Three balls of tetrahedra collide with friction (Stransky 2018, section 5.4, contact1): octahedra refined once, 32 tetrahedra each;
  radii 1, 1, 2 m; E = 3 MPa, nu = 0.2, 3,000 kg/m^3; contact modulus 50 MPa, stiffness ratio 10, friction angle 1.4 rad; 1,000 steps of
  0.5 ms. Bodies do not touch themselves.
- A bar hits a bar of the same section and material at rest: the contact lasts 2 L/c of the shorter one, L long; if the other one is n times
  as long, the coefficient of restitution is 1/n (wave theory of Saint-Venant).
- A rigid sphere is pressed into a block: Hertz.

Writes contact.png, contact.json, contact.html, and a series of VTK files of the balls (ball-*-*.vtu) into the folder `--output`. Takes a minute.

    python3 contact_bodies.py --output results
"""

import argparse
import json
import time
from pathlib import Path

import concordem
import numpy as np
from concordem import coupling

# ---- Three balls ---------------------------------------------------------------------------------------------------------------

BALLS = [(1.0, [0, 0, 0], [0, 0, 0]), (1.0, [2, 1, 0.6], [-5, -5, 0]), (2.0, [1, -4, 0.4], [0, 8, 0])]
BALL_STEP = 5e-4


def ball(radius, center, velocity):
    """An octahedron refined once, its nodes on a sphere, as 32 tetrahedra with a node in the middle."""
    import skfem

    points = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    number = {}

    def middle(a, b):
        place = np.add(points[a], points[b]) / np.linalg.norm(np.add(points[a], points[b]))
        key = tuple(np.round(place, 9))
        if key not in number:
            number[key] = len(points)
            points.append(tuple(place))
        return number[key]

    faces = []
    for a, b, c in [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]:
        d, e, f = middle(a, b), middle(b, c), middle(c, a)
        faces += [(a, d, f), (d, b, e), (f, e, c), (d, e, f)]
    nodes = np.vstack([np.array(points) * radius, [0, 0, 0]]) + center
    mesh = skfem.MeshTet(nodes.T, np.array([(*face, len(points)) for face in faces]).T)
    elements = coupling.ScikitDynamics(mesh, coupling.Elastic(3e6, 0.2, 3000.0), BALL_STEP)
    elements.velocity[:] = velocity
    return elements


def three_balls(steps=1000, folder=None, radius=0.2, cover=0.8):
    """The set-up contact1. Returns the series and the bodies."""
    law = {"frictional": {"young": 5e7, "stiffness_ratio": 10.0, "friction_coefficient": float(np.tan(1.4))}}
    bodies = [coupling.ContactBody(f"ball-{k}", ball(*of), law, radius, cover) for k, of in enumerate(BALLS)]
    scenario = concordem.Scenario(
        **coupling.contact_tables(bodies), integration={"time_step": BALL_STEP}, output={"sample_interval": 1}, stop={"steps": 10**9},
    )
    simulation = scenario.simulation(threads=1)
    contact = coupling.ContactCoupling(simulation, bodies)
    all_elements = [body.elements for body in bodies]

    def sums():
        momentum = sum(elements.momentum() for elements in all_elements)
        return momentum, sum(elements.angular_momentum() for elements in all_elements)

    start, energy = sums(), sum(elements.kinetic_energy for elements in all_elements)
    rows = {name: [] for name in ("time", "force", "lost", "lost_angular", "elements", "contacts", "balance", "shapes")}
    for k in range(steps):
        contact.step()
        now = sums()
        last = simulation.samples[-1]
        rows["time"].append((k + 1) * BALL_STEP)
        rows["force"].append([float(np.linalg.norm(exchange.force)) for exchange in contact.last])
        rows["lost"].append(float(np.abs(now[0] - start[0]).max() / np.abs(start[0]).max()))
        rows["lost_angular"].append(float(np.abs(now[1] - start[1]).max() / np.abs(start[1]).max()))
        rows["elements"].append(sum(elements.kinetic_energy + elements.internal_work for elements in all_elements) / energy)
        # What the contacts keep and dissipate is what the bodies gave them.
        kept = [last[name] for name in ("stored_normal", "stored_shear", "friction", "viscous", "integration")]
        rows["contacts"].append(float(sum(kept)) / energy)
        rows["balance"].append(rows["elements"][-1] + rows["contacts"][-1] - 1)
        if k in (0, 200, 400, 900):
            rows["shapes"].append(((k + 1) * BALL_STEP, [body.vertices.copy() for body in bodies]))
        if folder is not None and k % 25 == 0:
            for body, exchange in zip(bodies, contact.last):
                elements = body.elements
                force = np.zeros_like(elements.nodes)
                force[body.skin.nodes] = exchange.nodal
                coupling.write_vtk(folder / f"{body.name}-{k:05d}.vtu", elements.nodes + elements.displacement, elements.mesh.t.T, "tetra",
                                   {"displacement": elements.displacement, "velocity": elements.velocity, "contact_force": force})
    return rows, bodies


# ---- Two bars ------------------------------------------------------------------------------------------------------------------

YOUNG, DENSITY, AREA = 1e7, 1000.0, 0.01


def bar(start, length, bricks, step):
    """A bar of square section along x, one brick thick, without lateral strain."""
    import skfem

    side = 0.5 * np.sqrt(AREA)
    line = np.linspace(start, start + length, bricks + 1)
    mesh = skfem.MeshHex.init_tensor(line, np.linspace(-side, side, 2), np.linspace(-side, side, 2))
    return coupling.ScikitDynamics(mesh, coupling.Elastic(YOUNG, 0.0, DENSITY), step)


def two_bars(longer=1.0, bricks=40, speed=0.1):
    """A bar of 1 m hits one that is `longer` times as long. Returns contact time over 2 L/c, restitution, and the force over time.

    The contacts have the stiffness of one brick.
    """
    wave = np.sqrt(YOUNG / DENSITY)
    brick = 1.0 / bricks
    step, radius, gap = 0.3 * brick / wave, 0.05, 1e-4
    first, second = bar(0.0, 1.0, bricks, step), bar(1.0 + radius + gap, longer, round(longer * bricks), step)
    first.velocity[:, 0] = speed
    ends = [np.isclose(first.nodes[:, 0], 1.0), np.isclose(second.nodes[:, 0], 1.0 + radius + gap)]
    front = coupling.Skin(first, where=ends[0])
    count = len(coupling.SkinSpheres(front, radius))
    law = {"frictional": {"normal_stiffness": YOUNG * AREA / brick / count, "shear_stiffness": 0.0, "friction_coefficient": 0.0}}
    bodies = [
        coupling.ContactBody("first", first, law, radius, skin=front),
        coupling.ContactBody("second", second, law, skin=coupling.Skin(second, where=ends[1])),
    ]
    scenario = concordem.Scenario(**coupling.contact_tables(bodies), integration={"time_step": step}, stop={"steps": 10**9})
    contact = coupling.ContactCoupling(scenario.simulation(threads=1), bodies)
    times, forces = [], []
    for k in range(round((gap / speed + 1.4 * 2.0 / wave) / step)):
        contact.step()
        times.append(k * step)
        forces.append(contact.last[1].force[0])
    forces = np.array(forces)
    # From half of the force at the front to half of it at the end; ripples of the bricks follow.
    during = np.nonzero(forces > 0.25 * DENSITY * wave * AREA * speed)[0]
    lasted = (during[-1] - during[0]) * step
    means = [elements.momentum()[0] / elements.mass.sum() for elements in (first, second)]
    plateau = forces[during[len(during) // 3] : during[2 * len(during) // 3]].mean() / (0.5 * DENSITY * wave * AREA * speed)
    return {
        "contact_time": lasted * wave / 2.0, "restitution": (means[1] - means[0]) / speed, "plateau": plateau,
        "times": (np.array(times) - during[0] * step) * wave / 2.0, "forces": forces / (0.5 * DENSITY * wave * AREA * speed),
    }


# ---- A sphere on a block -------------------------------------------------------------------------------------------------------


def hertz(finest=0.08, depth=0.03, steps=1200, stiffness=15.0):
    """A rigid sphere of 1 m pressed `depth` (m) into a quarter of a block. Returns the force over that of Hertz.

    Bricks of `finest` (m) below the sphere, growing outwards. The contacts together are `stiffness` times as stiff as a layer of the
    radius of the contact.
    """
    import skfem

    radius, young, poisson, density = 1.0, 1e7, 0.3, 1000.0
    fine = int(np.ceil(0.4 / finest))
    sizes = np.concatenate([np.full(fine, finest), finest * 1.5 ** np.arange(1, 6 if finest > 0.06 else 8)])
    line = np.concatenate([[0.0], np.cumsum(sizes)])
    mesh = skfem.MeshHex.init_tensor(line, line, -line[::-1])
    places, size = mesh.p.T, line[-1]
    fixed = (places == 0) | (np.abs(places) == size)
    fixed[:, 2] = places[:, 2] == -size
    material = coupling.Elastic(young, poisson, density)
    step = 0.4 * coupling.ScikitDynamics(mesh, material).stable_time_step
    # About critical for the lowest vibration of the block.
    elements = coupling.ScikitDynamics(mesh, material, step, fixed=fixed, damping=1.5 * np.sqrt(young / density) / size)
    wide = line[fine] + 1e-9
    skin = coupling.Skin(elements, where=(places[:, 2] == 0) & (places[:, 0] < wide) & (places[:, 1] < wide))
    shell = finest
    contact_radius, modulus = np.sqrt(radius * depth), young / (1 - poisson**2)
    count = len(coupling.SkinSpheres(skin, shell, 0.6))
    law = {"frictional": {"normal_stiffness": stiffness * modulus / contact_radius * line[fine] ** 2 / count, "shear_stiffness": 0.0,
                          "friction_coefficient": 0.0}}
    # The tool: a cap whose nodes all move alike.
    across = np.linspace(0, 1.6 * contact_radius, 17)
    tool_mesh = skfem.MeshHex.init_tensor(across, across, np.array([0.0, 0.2]))
    nodes = tool_mesh.p.copy()
    surface = radius - np.sqrt(radius**2 - nodes[0] ** 2 - nodes[1] ** 2)
    low = nodes[2] == 0
    nodes[2] += np.where(low, surface, 0.0) + shell + 1e-6
    tool = coupling.ScikitDynamics(skfem.MeshHex(nodes, tool_mesh.t), coupling.Elastic(young, poisson, 50 * density), step,
                                   fixed=np.ones(nodes.shape[1], dtype=bool))
    bodies = [
        coupling.ContactBody("block", elements, law, shell, 0.6, skin),
        coupling.ContactBody("tool", tool, law, skin=coupling.Skin(tool, where=low)),
    ]
    scenario = concordem.Scenario(**coupling.contact_tables(bodies), integration={"time_step": step}, stop={"steps": 10**9})
    simulation = scenario.simulation(threads=1)
    contact = coupling.ContactCoupling(simulation, bodies)
    ramp = steps // 2
    for k in range(steps):
        # Half a sine, so that nothing is hit.
        speed = (depth + 1e-6) / (ramp * step) * 0.5 * np.pi * np.sin(np.pi * (k + 0.5) / ramp) if k < ramp else 0.0
        tool.prescribed[:, 2] = -speed
        contact.step()
    walls = simulation.forces().walls
    overlap = shell - np.linalg.norm(walls.point - simulation.state.positions[walls.particle], axis=1)
    return {
        "force": 4 * contact.last[1].force[2] / (4 / 3 * modulus * np.sqrt(radius) * depth**1.5),
        "bricks": len(mesh.t.T), "bricks_per_contact_radius": contact_radius / finest, "largest_overlap": float(overlap.max() / depth),
        "kinetic": elements.kinetic_energy / elements.internal_work,
    }


def picture(path, rows, bodies, bars):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    # Colors that color-blind readers tell apart (Okabe and Ito), and a line style for each.
    colors, styles = ["#0072B2", "#E69F00", "#009E73"], ["-", "--", ":"]
    figure, axes = pyplot.subplots(2, 3, figsize=(11, 7.5), layout="constrained")
    for axis, (moment, shapes) in zip(axes[0], rows["shapes"]):
        for color, body, vertices in zip(colors, bodies, shapes):
            axis.triplot(vertices[:, 0], vertices[:, 1], body.skin.triangles, color=color, linewidth=0.5)
        axis.set(aspect="equal", title=f"t = {moment:.3f} s", xlabel="x, m", xlim=(-3.5, 3.5), ylim=(-6.5, 5.5))
    axes[0][0].set_ylabel("y, m")
    t = np.array(rows["time"])
    for k in range(3):
        axes[1][0].plot(t, np.array(rows["force"])[:, k] / 1e6, color=colors[k], linestyle=styles[k], label=f"ball {k}")
    axes[1][0].set(xlabel="time, s", ylabel="contact force, MN")
    axes[1][0].legend(frameon=False)
    axes[1][1].plot(t, rows["elements"], color=colors[0], label="elements")
    axes[1][1].plot(t, np.array(rows["elements"]) + rows["contacts"], "--", color=colors[1], label="elements and contacts")
    axes[1][1].set(xlabel="time, s", ylabel="energy / energy of the start")
    axes[1][1].legend(frameon=False)
    for color, (longer, result) in zip(colors, bars.items()):
        axes[1][2].plot(result["times"], result["forces"], color=color, alpha=0.6, label=f"other bar {longer:g} L: e = {result['restitution']:.3f}")
    axes[1][2].plot([0, 0, 1, 1], [0, 1, 1, 0], "k:", label="wave theory")
    axes[1][2].set(xlabel="time / (2L/c)", ylabel="force / (ρcAv/2)", xlim=(-0.1, 1.4), ylim=(-0.1, 1.9), title="two bars")
    axes[1][2].legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("contact"))
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    rows, bodies = three_balls(folder=options.output)
    seconds = (time.perf_counter() - begin) / len(rows["time"])
    bars = {longer: two_bars(longer, 80) for longer in (1.0, 2.0)}
    block = hertz()
    result = {
        "spheres": [len(body.spheres) for body in bodies], "seconds_per_step": seconds,
        "lost_momentum": max(rows["lost"]), "lost_angular_momentum": max(rows["lost_angular"]),
        "energy_of_elements": rows["elements"][-1], "energy_of_contacts": rows["contacts"][-1],
        "largest_energy_error": float(np.abs(rows["balance"]).max()), "largest_force": np.max(rows["force"], axis=0).tolist(),
        "bars": {str(longer): {key: value for key, value in bar.items() if np.isscalar(value)} for longer, bar in bars.items()},
        "hertz": block,
    }
    (options.output / "contact.json").write_text(json.dumps(result, indent=1) + "\n")
    print(json.dumps(result, indent=1))
    picture(options.output / "contact.png", rows, bodies, bars)
    coupling.write_page(
        options.output / "contact.html", "Bodies in contact", "Three balls of finite elements collide with friction, in the set-up of Stránský 2018, "
        "section 5.4; two bars collide.", options.output / "contact.png",
        [("momentum lost, over that of the start", result["lost_momentum"], "1"), ("angular momentum lost", result["lost_angular_momentum"], "1"),
         ("energy of the elements at the end, over that of the start", result["energy_of_elements"], "1"),
         ("energy that went into the contacts", result["energy_of_contacts"], "1"), ("largest error of their sum", result["largest_energy_error"], "1")],
        [(f"largest force on ball {k}", force / 1e6, "MN") for k, force in enumerate(result["largest_force"])]
        + [("restitution of equal bars (theory 1)", bars[1.0]["restitution"], "1"), ("if one is twice as long (theory 0.5)", bars[2.0]["restitution"], "1"),
           ("rigid sphere on a block, force over that of Hertz", block["force"], "1")],
        ["contact.json", "ball-*-*.vtu"],
    )


if __name__ == "__main__":
    main()
