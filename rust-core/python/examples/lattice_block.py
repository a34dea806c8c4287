#!/usr/bin/env python3
"""A block of a bonded cubic lattice, half of it replaced by elements with the tensor of the lattice.

Tension, shear, bending, and torsion of a clamped block, in statics (motion damped until it rests). The lower half is the lattice, or
bricks that hold the lowest particles as slaves (volume coupling), or bricks on whose surface the particles stand, pressed together before
(surface coupling). Also two halves of bricks in contact, against one block with a layer of the stiffness of the contacts.

Writes lattice.png, lattice.json, lattice.html, and series of VTK files of the bent block of the volume coupling (bricks-*.vtu, particles-*.vtu)
into the folder `--output`. Takes some ten minutes.

    python3 lattice_block.py --output results
"""

import argparse
import json
from pathlib import Path

import concordem
import numpy as np
from concordem import coupling

SPACING, STIFFNESS, RATIO, DENSITY = 0.01, 1e5, 0.4, 2000.0
STEP = 0.2 * np.sqrt(DENSITY * SPACING**3 / STIFFNESS)
# Displacement and rotation of the upper end, over the length; and the component of force and moment that answers.
LOADS = {
    "tension": ([0, 0, 1e-5], [0, 0, 0], ("force", 2)), "shear": ([1e-5, 0, 0], [0, 0, 0], ("force", 0)),
    "bending": ([0, 0, 0], [0, 1e-3, 0], ("moment", 1)), "torsion": ([0, 0, 0], [0, 0, 1e-3], ("moment", 2)),
}
COMPRESSION = -3e-5
# Steps of the motion of the upper end and of the rest after it, per spacing of the length.
RAMP, HOLD = 150, 500


def bond():
    return {"normal_stiffness": STIFFNESS, "shear_stiffness": RATIO * STIFFNESS}


def material():
    # Spheres with the mass of their cube.
    return {"name": "lattice", "density": DENSITY * 6 / np.pi, "linear_bond": bond()}


def tensor():
    """Elastic tensor of the lattice, Pa."""
    places = [[(i + 0.5) * SPACING, (j + 0.5) * SPACING, (k + 0.5) * SPACING, 0.5 * SPACING] for i in range(3) for j in range(3) for k in range(3)]
    cells = coupling.RepresentativeCells(concordem.Scenario(
        packing={"kind": "spheres", "spheres": places, "cell": [3 * SPACING] * 3}, material=material(),
        bonds={"law": "linear_bond", "interaction_ratio": 1.01}, contacts={"law": "none"}, stop={"steps": 10**9},
    ))
    return cells.stiffness()[0]


def particles(columns, levels, held=True, skin=None):
    """Columns x columns x levels particles, their upper ones prescribed, and the lowest if `held`."""
    levels = list(levels)
    spheres = [[(i + 0.5) * SPACING, (j + 0.5) * SPACING, k * SPACING, 0.5 * SPACING] for k in levels for i in range(columns) for j in range(columns)]
    layer = columns**2
    sets = {"top": range(len(spheres) - layer, len(spheres))} | ({"low": range(layer)} if held else {})
    of_material, contacts, walls = material(), {"law": "none"}, []
    if skin is not None:
        # A contact has half of the length of a bond, hence twice its stiffness.
        of_material["frictional"] = {"normal_stiffness": 2 * STIFFNESS, "shear_stiffness": 2 * RATIO * STIFFNESS, "friction_coefficient": 100.0}
        contacts, walls = {"law": "frictional"}, [skin.wall("skin", "lattice")]
    return concordem.Scenario(
        packing={"kind": "spheres", "spheres": spheres}, material=of_material, bonds={"law": "linear_bond", "interaction_ratio": 1.01},
        contacts=contacts, wall=walls, set=[{"name": name, "selection": {"kind": "ids", "ids": list(ids)}} for name, ids in sets.items()],
        prescribe=[{"set": name, "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0]} for name in sets],
        integration={"time_step": STEP, "damping": {"kind": "local", "coefficient": 0.5}}, output={"sample_interval": 1000}, stop={"steps": 10**9},
    ).simulation(threads=1)


def bricks(columns, height, layers, bottom=0.0, free=False):
    """Elements with the tensor of the lattice, damped, their lower nodes fixed; or free and not damped."""
    import skfem

    line = np.arange(columns + 1) * SPACING
    mesh = skfem.MeshHex.init_tensor(line, line, np.linspace(bottom, bottom + height, layers + 1))
    stiffness = tensor()
    # Twice the lowest frequency or so.
    damping = 0.0 if free else 2 * np.sqrt(stiffness[0, 0] / DENSITY) / height
    fixed = (mesh.p[2] == bottom) & (not free)
    return coupling.ScikitDynamics(mesh, coupling.Elastic(stiffness=stiffness, density=DENSITY), STEP, fixed=fixed, damping=damping)


def load(simulation, step, columns, length, kind, factor=1.0):
    """Move the top, wait, and return force or moment of the lattice on it, and its change over the last tenth, over its size."""
    state = simulation.state
    rows = np.nonzero(np.isclose(state.positions[:, 2], state.positions[:, 2].max(), atol=0.2 * SPACING))[0]
    top = state.positions[rows].copy()
    center = np.array([0.5 * columns * SPACING, 0.5 * columns * SPACING, top[:, 2].mean()])
    shift, turn, (what, axis) = LOADS[kind] if isinstance(kind, str) else kind
    shift, turn = factor * np.array(shift) * length * SPACING, factor * np.array(turn) * length * SPACING
    ramp, hold = RAMP * length, HOLD * length

    def answer():
        contacts, on_top = simulation.forces().contacts, np.zeros(len(state), dtype=bool)
        on_top[rows] = True
        found = 0.0
        for side, sign in ((0, 1.0), (1, -1.0)):
            chosen = on_top[contacts.pair[:, side]] & ~on_top[contacts.pair[:, 1 - side]]
            force = sign * contacts.force[chosen]
            vector = force if what == "force" else np.cross(contacts.point[chosen] - center, force)
            found += vector.sum(axis=0)[axis]
        return found

    before = None
    for k in range(ramp + hold):
        rate = 0.5 * np.pi / (ramp * STEP) * np.sin(np.pi * (k + 0.5) / ramp) if k < ramp else 0.0
        velocity, spin = np.zeros((len(state), 3)), np.zeros((len(state), 3))
        velocity[rows], spin[rows] = rate * (shift + np.cross(turn, top - center)), rate * turn
        step(velocity, spin)
        if k == ramp + hold - hold // 10:
            before = answer()
    now = answer()
    return now, abs(now - before) / abs(now)


def whole(columns, length, kind):
    """Force or moment of the whole lattice of `length` bonds."""
    simulation = particles(columns, range(length + 1))

    def step(velocity, spin):
        simulation.set_motion(velocity, spin)
        simulation.step()

    return load(simulation, step, columns, length, kind)[0]


def joined(columns, length, below, free=False):
    """Lattice above `below` layers of bricks; its lowest particles are to be slaves, in the middles of the upper faces."""
    simulation = particles(columns, range(below, length + 1))
    return simulation, bricks(columns, below * SPACING, below, free=free), list(range(columns**2))


def in_the_volume(columns, length, below, kind, watch=None):
    """The same with the volume coupling, and how far it has settled. `watch`: takes the coupling after each step."""
    simulation, elements, slaves = joined(columns, length, below)
    volume = coupling.VolumeCoupling(simulation, elements, slaves)

    def step(velocity, spin):
        volume.step(1, motion=(velocity, spin))
        if watch is not None:
            watch(volume)

    return load(simulation, step, columns, length, kind)


class Watch:
    """What the interface passes and loses; pictures in a folder."""

    def __init__(self, folder, steps, count=10):
        self.folder, self.every = folder, max(1, steps // count)
        self.start, self.steps = None, 0
        self.largest, self.lost = np.zeros(3), np.zeros(3)

    def __call__(self, volume):
        elements, state = volume.elements, volume.simulation.state
        places = np.array(state.positions)
        if self.start is None:
            self.start = places.copy()
        last = volume.last
        sizes = [np.abs(last.force).max(), np.abs(last.moment).max(), abs(last.work)]
        self.largest = np.maximum(self.largest, sizes)
        self.lost = np.maximum(self.lost, [np.abs(last.lost_force).max(), np.abs(last.lost_moment).max(), abs(last.lost_work)])
        if self.steps % self.every == 0:
            coupling.write_vtk(self.folder / f"bricks-{self.steps:05d}.vtu", elements.nodes + elements.displacement,
                               elements.mesh.t.T[:, [6, 2, 0, 3, 7, 4, 1, 5]], "hexahedron", {"displacement": elements.displacement})
            coupling.write_vtk(self.folder / f"particles-{self.steps:05d}.vtu", places, point_data={
                "displacement": places - self.start, "radius": state.radii, "slave": np.isin(state.ids, volume.slaves).astype(float)})
        self.steps += 1
        self.volume, self.shift = volume, places - self.start


def below_a_surface(columns, length, below, kind):
    """The same with the surface coupling: the particles stand on the bricks, half a spacing above them."""
    height = (below - 0.5) * SPACING
    elements = bricks(columns, height, below)
    skin = coupling.Skin(elements, where=np.isclose(elements.nodes[:, 2], height))
    simulation = particles(columns, range(below, length + 1), held=False, skin=skin)
    surface = coupling.SurfaceCoupling(simulation, elements, skin)

    def step(velocity, spin):
        simulation.set_motion(velocity, spin)
        surface.step()

    what = LOADS[kind][2]
    pressed, _ = load(simulation, step, columns, length, ([0, 0, COMPRESSION], [0, 0, 0], what))
    # In compression contacts carry, so the block answers in both directions.
    now, settled = load(simulation, step, columns, length, kind)
    return now - pressed, settled * abs(now) / abs(now - pressed)


def upper_end(elements, columns):
    """Nodes of the upper end, and their places from its middle."""
    top = np.nonzero(elements.nodes[:, 2] == elements.nodes[:, 2].max())[0]
    return top, elements.nodes[top] - [0.5 * columns * SPACING, 0.5 * columns * SPACING, elements.nodes[top[0], 2]]


def answer(elements, columns, what):
    """A component of the force or moment on the upper end."""
    top, arm = upper_end(elements, columns)
    force, (kind, axis) = elements.internal_forces()[top], what
    return (force if kind == "force" else np.cross(arm, force)).sum(axis=0)[axis]


def driven(step, elements, columns, length, kind):
    """Move the upper end of elements, wait, and return force or moment on it, and its change over the last tenth, over its size."""
    shift, turn, what = LOADS[kind] if isinstance(kind, str) else kind
    shift, turn = np.array(shift) * length * SPACING, np.array(turn) * length * SPACING
    top, arm = upper_end(elements, columns)
    ramp, hold = RAMP * length, HOLD * length
    before = 0.0
    for k in range(ramp + hold):
        rate = 0.5 * np.pi / (ramp * STEP) * np.sin(np.pi * (k + 0.5) / ramp) if k < ramp else 0.0
        elements.prescribed[top] = rate * (shift + np.cross(turn, arm))
        step()
        if k == ramp + hold - hold // 10:
            before = answer(elements, columns, what)
    now = answer(elements, columns, what)
    return now, abs(now - before) / abs(now)


class Pressed:
    """Two halves of bricks in contact, pressed together: the state from which loads start."""

    def __init__(self, columns, length):
        self.contact, self.upper = halves(columns, length)
        self.force, self.settled = driven(self.contact.step, self.upper, columns, length, ([0, 0, COMPRESSION], [0, 0, 0], ("force", 2)))
        self.snapshot = self.contact.simulation.snapshot()
        self.elements = [body.elements.save() for body in self.contact.bodies]

    def again(self):
        """The pressed state, after a load."""
        self.contact.simulation.restore(self.snapshot)
        for body, state in zip(self.contact.bodies, self.elements, strict=True):
            body.elements.restore(state)
        return self.contact, self.upper


def in_contact(columns, length, kind=None, pressed=None):
    """Two halves of bricks in contact, pressed together; then loaded, if `kind` is given.

    Returns the force (or moment) of pressing or of the load, that of one block with a layer of the stiffness of the contacts, and how far it
    has settled.
    """
    pressed = pressed or Pressed(columns, length)
    if kind is None:
        # In series: `length` layers of bricks and one of contacts, each of the stiffness of a layer of bonds.
        return pressed.force, COMPRESSION * length * SPACING * STIFFNESS * columns**2 / (length + 1), pressed.settled
    contact, upper = pressed.again()
    before = answer(upper, columns, LOADS[kind][2])
    now, settled = driven(contact.step, upper, columns, length, kind)
    return now - before, with_a_layer(columns, length, 0.5 * SPACING, kind), settled * abs(now) / abs(now - before)


def halves(columns, length):
    """Two halves of bricks, half a spacing apart, with spheres on the lower one: the coupling, and the upper half."""
    half, radius = 0.5 * length * SPACING, 0.5 * SPACING
    lower, upper = bricks(columns, half, length // 2), bricks(columns, half, length // 2, half + radius)
    # The upper end of the upper half moves, the lower one is free.
    upper.fixed[:] = np.isclose(upper.nodes[:, 2], length * SPACING + radius)[:, None]
    faces = [np.isclose(lower.nodes[:, 2], half), np.isclose(upper.nodes[:, 2], half + radius)]
    skin = coupling.Skin(lower, where=faces[0])
    count = len(coupling.SkinSpheres(skin, radius, 0.6))
    # All contacts together are as stiff as one layer of bonds.
    normal = STIFFNESS * columns**2 / count
    law = {"frictional": {"normal_stiffness": normal, "shear_stiffness": RATIO * normal, "friction_coefficient": 100.0}}
    bodies = [
        coupling.ContactBody("lower", lower, law, radius, 0.6, skin),
        coupling.ContactBody("upper", upper, law, skin=coupling.Skin(upper, where=faces[1])),
    ]
    scenario = concordem.Scenario(**coupling.contact_tables(bodies), integration={"time_step": STEP, "allow_energy_error": True}, stop={"steps": 10**9})
    return coupling.ContactCoupling(scenario.simulation(threads=1), bodies), upper


def with_a_layer(columns, length, thickness, kind):
    """Force or moment of one block of bricks, whose halves a thin layer joins that is as stiff as one layer of bonds."""
    import skfem

    half, line = 0.5 * length * SPACING, np.arange(columns + 1) * SPACING
    levels = np.linspace(0, half, length // 2 + 1)
    mesh = skfem.MeshHex.init_tensor(line, line, np.concatenate([levels, half + thickness + levels]))
    middle = mesh.p[2, mesh.t].mean(axis=0)
    # Per area: one bond per square of the spacing. Along the layer it does not carry.
    along = STIFFNESS / SPACING**2 * thickness
    layer = np.diag([1e-4 * along, 1e-4 * along, along, RATIO * along, RATIO * along, 1e-4 * along])
    stiffness = tensor()
    materials = [coupling.Elastic(stiffness=stiffness, density=DENSITY), coupling.Elastic(stiffness=layer, density=DENSITY)]
    of = ((middle > half) & (middle < half + thickness)).astype(int)
    ends = (mesh.p[2] == 0) | (mesh.p[2] == mesh.p[2].max())
    damping = 2 * np.sqrt(stiffness[0, 0] / DENSITY) / (2 * half)
    elements = coupling.ScikitDynamics(mesh, coupling.Layers(materials, of), STEP, fixed=ends, damping=damping)
    return driven(elements.step, elements, columns, length, kind)[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("lattice"))
    parser.add_argument("--sizes", type=int, nargs="+", default=[2, 3, 4], help="columns; the length is three times as much")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    result = {}
    for columns in options.sizes:
        length = 3 * columns
        row = {}
        for kind in LOADS:
            reference = whole(columns, length, kind)
            row[kind] = {"volume": in_the_volume(columns, length, length // 2, kind)[0] / reference - 1}
            if kind != "torsion":
                row[kind]["surface"] = below_a_surface(columns, length, length // 2, kind)[0] / reference - 1
            print(columns, kind, row[kind], flush=True)
        pressed = Pressed(columns, 2 * (length // 2))
        force, expected, _ = in_contact(columns, 2 * (length // 2), pressed=pressed)
        row["compression"] = {"contact": force / expected - 1}
        print(columns, "compression", row["compression"], flush=True)
        for kind in LOADS:
            force, expected, _ = in_contact(columns, 2 * (length // 2), kind, pressed)
            row[kind]["contact"] = force / expected - 1
            print(columns, kind, "contact", row[kind]["contact"], flush=True)
        result[columns] = row
    columns = options.sizes[-1]
    length = 3 * columns
    watch = Watch(options.output, (RAMP + HOLD) * length)
    in_the_volume(columns, length, length // 2, "bending", watch)
    interface = {
        "work": watch.volume.work, "external_work": watch.volume.elements.external_work, "balance": watch.volume.elements.balance,
        "lost": dict(zip(("force", "moment", "work"), (watch.lost / watch.largest).tolist())),
    }
    (options.output / "lattice.json").write_text(json.dumps({"sizes": result, "interface": interface}, indent=1) + "\n")
    picture(options.output / "lattice.png", result, watch)
    coupling.write_page(
        options.output / "lattice.html", "Half of a lattice, replaced by elements",
        "A clamped block of a bonded cubic lattice is pulled, sheared, bent, and twisted. Its lower half is the lattice, or bricks with the tensor of "
        "the lattice, coupled by volume or surface; the stiffness of both is compared. Contact: two halves of bricks, compared with one block. The "
        "interface is that of the bent block with the volume coupling.", options.output / "lattice.png",
        [("work of the slaves on the nodes", interface["work"], "J"), ("external work in the ledger of the elements", interface["external_work"], "J"),
         ("residual of the ledger of the elements", interface["balance"], "J")]
        + [(f"largest loss of {name} in an exchange, over the largest {name}", value, "1") for name, value in interface["lost"].items()],
        [(f"{kind}, {n} columns, {way}: error of the stiffness", value, "1") for n, row in result.items() for kind, ways in row.items()
         for way, value in ways.items()],
        ["lattice.json", "bricks-*.vtu", "particles-*.vtu"],
    )


def picture(path, result, watch):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.collections import EllipseCollection, PolyCollection

    figure, (axis, block) = pyplot.subplots(1, 2, figsize=(9, 5.5), layout="constrained", width_ratios=[1.5, 1])
    for color, kind in enumerate(LOADS):
        for way, mark in (("volume", "o-"), ("surface", "s--"), ("contact", "^:")):
            points = [(n, abs(row[kind][way])) for n, row in result.items() if way in row[kind]]
            if points:
                axis.loglog(*zip(*points), mark, color=f"C{color}", label=f"{kind}, {way}")
    axis.set(xlabel="columns of the block", ylabel="relative error of the stiffness")
    axis.set_xticks(list(result), [str(n) for n in result])
    axis.minorticks_off()
    axis.legend(frameon=False, fontsize=8, ncols=4, loc="upper center", bbox_to_anchor=(0.5, -0.12))
    # The bent block from the side, with displacements that can be seen.
    elements, state = watch.volume.elements, watch.volume.simulation.state
    size = np.ptp(elements.nodes, axis=0).max()
    factor = 0.1 * size / np.abs(watch.shift).max()
    nodes = 1e3 * (elements.nodes + factor * elements.displacement)[:, [0, 2]]
    front = elements.nodes[:, 1] == elements.nodes[:, 1].min()
    faces = []
    for brick in elements.mesh.t.T:
        corners = brick[front[brick]]
        if len(corners) == 4:
            middle = elements.nodes[corners].mean(axis=0)
            faces.append(sorted(corners, key=lambda node: np.arctan2(*(elements.nodes[node] - middle)[[0, 2]])))
    block.add_collection(PolyCollection(nodes[np.array(faces)], facecolors="none", edgecolors="C0"))
    places = 1e3 * (watch.start + factor * watch.shift)
    own = np.isclose(watch.start[:, 1], watch.start[:, 1].min())
    slaves = np.isin(state.ids, watch.volume.slaves)
    width = np.full(own.sum(), 1e3 * SPACING)
    block.add_collection(EllipseCollection(width, width, 0 * width, units="xy", offsets=places[own][:, [0, 2]], transOffset=block.transData,
                                           facecolors=np.where(slaves[own], "C3", "C1"), edgecolors="k", linewidths=0.3))
    block.autoscale_view()
    block.set(aspect="equal", xlabel="x, mm", ylabel="z, mm", title=f"bent; displacements\ntimes {factor:.0f}", xlim=(places[:, 0].min() - 8, places[:, 0].max() + 8),
              ylim=(-3, places[:, 2].max() + 8))
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
