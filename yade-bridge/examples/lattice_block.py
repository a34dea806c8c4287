#!/usr/bin/env python3
"""A block of a bonded cubic lattice, half of it replaced by elements with the tensor of the lattice.

Tension, shear, bending, and torsion of a clamped block, in statics (motion damped until it rests). The lower half is the lattice, or
bricks that hold the lowest particles as slaves (volume coupling), or bricks on whose surface the particles stand, pressed together before
(surface coupling). Also two halves of bricks in contact.

Writes lattice.png and lattice.json into the folder `--output`. Takes some ten minutes.

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


def in_the_volume(columns, length, below, kind):
    """The same with the volume coupling, and how far it has settled."""
    simulation, elements, slaves = joined(columns, length, below)
    volume = coupling.VolumeCoupling(simulation, elements, slaves)
    return load(simulation, lambda velocity, spin: volume.step(1, motion=(velocity, spin)), columns, length, kind)


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


def in_contact(columns, length):
    """Two halves of bricks pressed together: force, that of one block with the compliance of the contacts, and how far it has settled."""
    half, radius = 0.5 * length * SPACING, 0.5 * SPACING
    lower, upper = bricks(columns, half, length // 2), bricks(columns, half, length // 2, half + radius)
    # The upper end of the upper half moves, the lower one is free.
    upper.fixed[:] = np.isclose(upper.nodes[:, 2], length * SPACING + radius)[:, None]
    faces = [np.isclose(lower.nodes[:, 2], half), np.isclose(upper.nodes[:, 2], half + radius)]
    skin = coupling.Skin(lower, where=faces[0])
    count = len(coupling.SkinSpheres(skin, radius, 0.6))
    # All contacts together are as stiff as one layer of bonds.
    law = {"frictional": {"normal_stiffness": STIFFNESS * columns**2 / count, "shear_stiffness": 0.0, "friction_coefficient": 0.0}}
    bodies = [
        coupling.ContactBody("lower", lower, law, radius, 0.6, skin),
        coupling.ContactBody("upper", upper, law, skin=coupling.Skin(upper, where=faces[1])),
    ]
    scenario = concordem.Scenario(**coupling.contact_tables(bodies), integration={"time_step": STEP, "allow_energy_error": True}, stop={"steps": 10**9})
    contact = coupling.ContactCoupling(scenario.simulation(threads=1), bodies)
    press = -COMPRESSION * length * SPACING
    ramp, hold = RAMP * length, HOLD * length
    before = 0.0
    for k in range(ramp + hold):
        rate = 0.5 * np.pi / (ramp * STEP) * np.sin(np.pi * (k + 0.5) / ramp) if k < ramp else 0.0
        upper.prescribed[:, 2] = np.where(upper.fixed[:, 2], -press * rate, 0.0)
        contact.step()
        if k == ramp + hold - hold // 10:
            before = contact.last[1].force[2]
    now = contact.last[1].force[2]
    # In series: `length` layers of bricks and one of contacts, each of the stiffness of a layer of bonds.
    return now, press * STIFFNESS * columns**2 / (length + 1), abs(now - before) / abs(now)


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
        force, expected, _ = in_contact(columns, 2 * (length // 2))
        row["compression"] = {"contact": force / expected - 1}
        print(columns, "compression", row["compression"], flush=True)
        result[columns] = row
    (options.output / "lattice.json").write_text(json.dumps(result, indent=1) + "\n")
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axis = pyplot.subplots(figsize=(6, 4), layout="constrained")
    for kind in LOADS:
        for way, mark in (("volume", "o-"), ("surface", "s--")):
            points = [(n, abs(row[kind][way])) for n, row in result.items() if way in row[kind]]
            if points:
                axis.loglog(*zip(*points), mark, label=f"{kind}, {way}")
    axis.set(xlabel="columns of the block", ylabel="relative error of the stiffness")
    axis.legend(frameon=False, fontsize=8)
    figure.savefig(options.output / "lattice.png", dpi=110)


if __name__ == "__main__":
    main()
