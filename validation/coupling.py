#!/usr/bin/env python3
"""Time per step of the couplings with finite elements, beside particles alone and elements alone; and of cells on one and two threads.

Each coupling runs in parts; the same parts of particles alone and of elements alone run in between, so that the load of the machine is the
same. The figure is the median of the parts. Run it on an idle machine.

    .venv/bin/python validation/coupling.py --output validation/results/coupling-speed.json
"""

import argparse
import json
import os
import time
from pathlib import Path
from statistics import median

import concordem
import numpy as np
from concordem import coupling


def block(count, low=(0, 0, 0), spacing=0.01):
    """Spheres of a cubic lattice, (n, 4)."""
    axes = [low[i] + spacing * np.arange(count[i]) for i in range(3)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return [[*place, 0.5 * spacing] for place in places.tolist()]


def bricks(count, low, step, spacing=0.01, free=True, damping=0.0):
    import skfem

    lines = [low[i] + spacing * np.arange(count[i] + 1) for i in range(3)]
    mesh = skfem.MeshHex.init_tensor(*lines)
    fixed = np.zeros(mesh.p.shape[1], dtype=bool) if free else mesh.p[2] == low[2]
    return coupling.ScikitDynamics(mesh, coupling.Elastic(1e7, 0.2, 2000.0), step, fixed=fixed, damping=damping)


BONDED = {"name": "m", "density": 2000.0, "linear_bond": {"normal_stiffness": 1e5, "shear_stiffness": 4e4}}
TOUCHING = BONDED | {"frictional": {"normal_stiffness": 1e5, "shear_stiffness": 4e4, "friction_coefficient": 0.4}}
STEP = 1e-5


def volume(side, length):
    """A block of bonded particles, whose lowest layer is in bricks."""
    spheres = block((side, side, length))
    scenario = concordem.Scenario(
        packing={"kind": "spheres", "spheres": spheres}, material=BONDED, bonds={"law": "linear_bond", "interaction_ratio": 1.1},
        contacts={"law": "none"}, set=[{"name": "slaves", "selection": {"kind": "box", "minimum": [-1, -1, -1], "maximum": [1, 1, 0.002]}}],
        prescribe=[{"set": "slaves", "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0]}],
        integration={"time_step": STEP}, output={"sample_interval": 1000}, stop={"steps": 10**9},
    )

    def elements():
        made = bricks((side, side, 5), (-0.005, -0.005, -0.045), STEP, free=False)
        made.velocity[:, 2] = 0.01 * (made.nodes[:, 2] + 0.045)
        return made

    joined = elements()
    simulation = scenario.simulation(threads=1)
    slaves = np.sort(np.array(simulation.state.ids)[np.array(simulation.state.positions)[:, 2] < 0.002])
    coupled = coupling.VolumeCoupling(simulation, joined, slaves)
    return coupled.step, scenario.simulation(threads=1).step, elements, {"particles": len(spheres), "slaves": len(slaves), "hexahedra": 5 * side**2}


def surface(side, length):
    """A block of bonded particles that lies on bricks."""
    spheres = block((side, side, length), (0, 0, 0.00499))
    elements = bricks((side, side, 5), (-0.005, -0.005, -0.05), STEP, free=False)
    skin = coupling.Skin(elements, where=np.isclose(elements.nodes[:, 2], 0))
    scenario = concordem.Scenario(
        packing={"kind": "spheres", "spheres": spheres}, material=TOUCHING, bonds={"law": "linear_bond", "interaction_ratio": 1.1},
        contacts={"law": "frictional"}, wall=[skin.wall("skin", "m")], integration={"time_step": STEP, "gravity": [0, 0, -9.81]},
        output={"sample_interval": 1000}, stop={"steps": 10**9},
    )
    coupled = coupling.SurfaceCoupling(scenario.simulation(threads=1), elements, skin)
    return (coupled.step, scenario.simulation(threads=1).step, lambda: bricks((side, side, 5), (-0.005, -0.005, -0.05), STEP, free=False),
            {"particles": len(spheres), "triangles": len(skin.triangles), "hexahedra": 5 * side**2})


def contact(side):
    """Two blocks of bricks; the upper one comes down, and they touch from the first steps on."""
    law = {"frictional": {"normal_stiffness": 2e4, "shear_stiffness": 1e4, "friction_coefficient": 0.4}}
    made = [bricks((side, side, 5), (0, 0, z), STEP) for z in (0.0, 0.05501)]
    made[1].velocity[:, 2] = -0.05
    faces = [np.isclose(made[0].nodes[:, 2], 0.05), np.isclose(made[1].nodes[:, 2], 0.05501)]
    bodies = [coupling.ContactBody("low", made[0], law, 0.005, 0.9, coupling.Skin(made[0], where=faces[0])),
              coupling.ContactBody("high", made[1], law, skin=coupling.Skin(made[1], where=faces[1]))]
    scenario = concordem.Scenario(**coupling.contact_tables(bodies), integration={"time_step": STEP}, output={"sample_interval": 1000},
                                  stop={"steps": 10**9})
    coupled = coupling.ContactCoupling(scenario.simulation(threads=1), bodies)

    class Both:
        def __init__(self):
            self.made = [bricks((side, side, 5), (0, 0, z), STEP) for z in (0.0, 0.05501)]

        def step(self):
            for one in self.made:
                one.step()

    return coupled.step, scenario.simulation(threads=1).step, Both, {"spheres": len(bodies[0].spheres), "hexahedra": 10 * side**2}


def pressed(side):
    """Two blocks of bricks; a pressure on the upper one holds them together, so that the spheres touch in every step that is timed."""
    law = {"frictional": {"normal_stiffness": 2e4, "shear_stiffness": 1e4, "friction_coefficient": 0.4}}

    def both():
        # Damping of the order of the lowest frequency. Shifted, so that no sphere is above an edge of the other mesh.
        places = [(0.0, 0.0, 0.0), (0.0033, 0.0021, 0.05501)]
        return [bricks((side, side, 5), place, STEP, free=place[2] > 0, damping=2000.0) for place in places]

    made = both()
    faces = [np.isclose(made[0].nodes[:, 2], 0.05), np.isclose(made[1].nodes[:, 2], 0.05501)]
    bodies = [coupling.ContactBody("low", made[0], law, 0.005, 0.9, coupling.Skin(made[0], where=faces[0])),
              coupling.ContactBody("high", made[1], law, skin=coupling.Skin(made[1], where=faces[1]))]
    scenario = concordem.Scenario(**coupling.contact_tables(bodies), integration={"time_step": STEP}, output={"sample_interval": 1000},
                                  stop={"steps": 10**9})
    simulation = scenario.simulation(threads=1)
    coupled = coupling.ContactCoupling(simulation, bodies)
    # 10 kPa on all nodes of the upper block, by their mass.
    load = np.zeros_like(made[1].nodes)
    load[:, 2] = -1e4 * (0.01 * side) ** 2 * made[1].mass / made[1].mass.sum()

    def step(count):
        coupled.step(count, loads=[None, load])

    def touching():
        return int((np.linalg.norm(simulation.forces().walls.force, axis=1) > 0).sum())

    step(800)

    class Both:
        def __init__(self):
            self.made = both()

        def step(self):
            for one in self.made:
                one.step()

    return step, scenario.simulation(threads=1).step, Both, {"spheres": len(bodies[0].spheres), "hexahedra": 10 * side**2}, touching


def timed(step, count):
    begin = time.perf_counter()
    step(count)
    return (time.perf_counter() - begin) / count


def beside(coupled, particles, elements, sizes, parts, steps, touching=None):
    """Medians, in seconds per step. `touching`: counts the present contacts; at least half of the spheres must touch after every part."""
    alone = elements()

    def of_elements(count):
        for _ in range(count):
            alone.step()

    found = {"coupled": [], "particles": [], "elements": []}
    for part in range(parts + 1):
        for name, step in [("particles", particles), ("elements", of_elements), ("coupled", coupled)]:
            seconds = timed(step, steps)
            # The first part warms up.
            if part:
                found[name].append(seconds)
        if touching is not None:
            sizes["touching"] = min(touching(), sizes.get("touching", sizes["spheres"]))
    if 2 * sizes.get("touching", sizes.get("spheres", 0)) < sizes.get("spheres", 0):
        raise SystemExit(f"only {sizes['touching']} of {sizes['spheres']} spheres touch")
    result = {name: median(values) for name, values in found.items()}
    extra = [c - p - e for c, p, e in zip(found["coupled"], found["particles"], found["elements"])]
    return sizes | {"seconds_per_step": result, "exchange": median(extra), "parts": found}


def cells(count, parts, steps):
    """Seconds per step of a cell on one and two threads, and the efficiency of two."""
    scenario = concordem.Scenario(
        packing={"kind": "random-dense", "count": 64, "radius": 0.01, "seed": 1, "shape": {"kind": "periodic", "tiles": [1, 1, 1]}},
        material={"name": "m", "density": 2000.0, "cpm": {"young": 4e6, "shear_ratio": 0.2, "crack_onset_strain": 1.0, "relative_ductility": 10,
                                                         "cohesion": 1e9, "friction_coefficient": 0.0}},
        bonds={"law": "cpm", "interaction_ratio": 1.5}, contacts={"law": "cpm"},
        integration={"damping": {"kind": "local", "coefficient": 0.2}}, stop={"steps": 10**9},
    )
    groups = {threads: coupling.RepresentativeCells(scenario, count, threads=threads) for threads in (1, 2)}
    found = {1: [], 2: []}
    for part in range(parts + 1):
        for threads, group in groups.items():
            gradient = np.tile(np.diag([1.0, 1.0, 1.0 - 1e-6 * (part + 1)]), (count, 1, 1))
            begin = time.perf_counter()
            group.deform(gradient, steps)
            seconds = (time.perf_counter() - begin) / (count * steps)
            if part:
                found[threads].append(seconds)
    if groups[1].state_hashes() != groups[2].state_hashes():
        raise SystemExit("the cells depend on the number of threads")
    one, two = median(found[1]), median(found[2])
    ratios = [a / (2 * b) for a, b in zip(found[1], found[2])]
    return {"cells": count, "steps_per_deformation": steps, "seconds_per_cell_step": {"1": one, "2": two}, "efficiency": median(ratios)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("coupling-speed.json"))
    parser.add_argument("--parts", type=int, default=9)
    parser.add_argument("--steps", type=int, default=100)
    options = parser.parse_args()
    result = {
        "version": concordem.__version__, "parts": options.parts, "steps": options.steps,
        "load_before": os.getloadavg()[0],
        "volume": [beside(*volume(9, length), options.parts, options.steps) for length in (10, 100)],
        "surface": [beside(*surface(9, length), options.parts, options.steps) for length in (10, 100)],
        "contact": [beside(*contact(side), options.parts, options.steps) for side in (4, 9)],
        "pressed": [beside(*case, options.parts, options.steps, touching) for side in (4, 9) for *case, touching in [pressed(side)]],
        "cells": [cells(count, options.parts, 50) for count in (2, 16, 64)],
    }
    result["load_after"] = os.getloadavg()[0]
    options.output.write_text(json.dumps(result, indent=1) + "\n")
    for name in ("volume", "surface", "contact", "pressed"):
        for row in result[name]:
            times = {key: 1e3 * value for key, value in row["seconds_per_step"].items()}
            sizes = ", ".join(f"{row[key]} {key}" for key in row if isinstance(row[key], int))
            print(f"{name:8s} {sizes}: particles {times['particles']:.3f}, elements {times['elements']:.3f}, coupled {times['coupled']:.3f}, "
                  f"exchange {1e3 * row['exchange']:.3f} ms per step")
    for row in result["cells"]:
        times = row["seconds_per_cell_step"]
        print(f"{row['cells']} cells: {1e6 * times['1']:.1f} and {1e6 * times['2']:.1f} microseconds per cell and step; efficiency of two threads {row['efficiency']:.2f}")


if __name__ == "__main__":
    main()
