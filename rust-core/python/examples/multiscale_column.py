#!/usr/bin/env python3
"""Multiscale coupling: a column of three bricks; in the lower two, each integration point is a periodic cell of particles.

The set-up of Stránský 2018, section 5.3 (multi1): unit bricks, sides fixed, the top moves down; 16 cells, eight in the middle brick
with bonds of a modulus of 4 MPa and eight in the bottom brick with 2 MPa; the top brick is elastic. Before large strains, the stress of
each layer is its oedometric modulus times its strain, with the modulus of the static network of its cell.

Writes column.png, column.json, column.html, and series of VTK files of the bricks (bricks-*.vtu) and of the particles of all cells, drawn at their
integration points (particles-*.vtu), into the folder `--output`. Takes half a minute.

    python3 multiscale_column.py --output results
"""

import argparse
import json
import time
from pathlib import Path

import concordem
import numpy as np
from concordem import coupling


def cell(young):
    """A periodic cell of 64 spheres or so, r = 10 mm, that does not break."""
    return concordem.Scenario(
        packing={"kind": "random-dense", "count": 64, "radius": 0.01, "seed": 1, "shape": {"kind": "periodic", "tiles": [1, 1, 1]}},
        material={"name": "m", "density": 2000.0, "cpm": {
            "young": young, "shear_ratio": 0.2, "crack_onset_strain": 1.0, "relative_ductility": 10, "cohesion": 1e9, "friction_coefficient": 0.0}},
        bonds={"law": "cpm", "interaction_ratio": 1.5}, contacts={"law": "cpm"},
        integration={"damping": {"kind": "local", "coefficient": 0.2}}, stop={"steps": 10**9},
    )


def column(strain, elements_steps, cell_steps=4, threads=None, folder=None):
    """Compress the column by `strain`; returns one row per layer from the bottom: strain, mean stress, modulus, and seconds per step."""
    import skfem

    mesh = skfem.MeshHex.init_tensor([0, 1], [0, 1], np.linspace(0, 3, 4))
    height = mesh.p[2, mesh.t].mean(axis=0)
    cells = [coupling.RepresentativeCells(cell(young), 8, threads=threads) for young in (2e6, 4e6)]
    materials = [coupling.CellMaterial(one, cell_steps, 2000.0) for one in cells] + [coupling.Elastic(4e6, 0.2, 2000.0)]
    fixed = np.zeros((mesh.p.shape[1], 3), dtype=bool)
    fixed[:, :2] = True
    fixed[:, 2] = (mesh.p[2] == 0) | (mesh.p[2] == 3)
    # The period of the column is a second or so; the damping lets it follow.
    elements = coupling.ScikitDynamics(mesh, coupling.Layers(materials, np.floor(height).astype(int)), safety=0.5, damping=30.0, fixed=fixed)
    rate = -3 * strain / (elements_steps * elements.time_step)
    begin = time.perf_counter()
    for k in range(4 * elements_steps):
        # A quarter of the steps moves the top, the others let the column come to rest.
        elements.prescribed[mesh.p[2] == 3, 2] = rate if k < elements_steps else 0.0
        if folder is not None and k % max(1, elements_steps // 4) == 0:
            order = [6, 2, 0, 3, 7, 4, 1, 5]
            coupling.write_vtk(folder / f"bricks-{k:05d}.vtu", mesh.p.T + elements.displacement, mesh.t.T[:, order], "hexahedron",
                               {"displacement": elements.displacement})
            write_particles(folder / f"particles-{k:05d}.vtu", elements, cells, np.floor(height).astype(int))
        elements.step()
    seconds = (time.perf_counter() - begin) / (4 * elements_steps)
    levels = np.array([elements.displacement[mesh.p[2] == z, 2].mean() for z in range(4)])
    oedometric = [float(one.stiffness()[0][2, 2]) for one in cells] + [4e6 * 0.8 / (1.2 * 0.6)]
    stress = [float(material.cauchy[:, 2, 2].mean()) for material in materials[:2]]
    # The force that passes through all layers, over the area 1.
    forces = elements.internal_forces()
    rows = [{"strain": float(e), "stress": s, "modulus": m} for e, s, m in
            zip(np.diff(levels), [*stress, float(forces[mesh.p[2] == 3, 2].sum())], oedometric)]
    return rows, seconds, float(abs(elements.balance) / abs(elements.internal_work))


def write_particles(path, elements, cells, layers):
    """Particles of all cells, each cell around its integration point, with the stress of the cell. `layers`: layer of each element."""
    places, radii, stresses = [], [], []
    points = elements.points().reshape(len(layers), -1, 3)
    for layer, group in enumerate(cells):
        stress = group.response().stress[:, 2, 2]
        for cell, point in enumerate(points[layers == layer].reshape(-1, 3)):
            particles = group.particles(cell)
            # Particles are somewhere around the periodic cell: move them into it.
            share = np.linalg.solve(particles.edges, particles.position.T).T
            inside = (share - np.floor(share) - 0.5) @ particles.edges.T
            places.append(point + inside)
            radii.append(particles.radius)
            stresses.append(np.full(len(inside), stress[cell]))
    coupling.write_vtk(path, np.concatenate(places), point_data={"radius": np.concatenate(radii), "stress of the cell, zz": np.concatenate(stresses)})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("column"))
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    small, one, _ = column(1e-4, 400, threads=1)
    again, two, balance = column(1e-4, 400, threads=2)
    if small != again:
        raise SystemExit("the column depends on the number of threads")
    curve = [(strain, column(strain, 400, folder=options.output if strain == 0.2 else None)[0]) for strain in (1e-3, 0.01, 0.05, 0.1, 0.2)]
    result = {"layers": small, "seconds_per_step": {"1": one, "2": two}, "cell_steps_per_step": 64, "balance": balance,
              "large": [{"strain": strain, "layers": rows} for strain, rows in curve]}
    (options.output / "column.json").write_text(json.dumps(result, indent=1) + "\n")
    for name, row in zip(("bottom", "middle", "top"), small):
        print(f"{name:7s} strain {row['strain']:.6e}  stress {row['stress']:.4f} Pa  E_oed strain {row['modulus'] * row['strain']:.4f} Pa  "
              f"ratio {row['stress'] / (row['modulus'] * row['strain']):.6f}")
    print(f"seconds per step of the elements (16 cells, 4 steps each): {one:.6f} with 1 thread, {two:.6f} with 2; "
          f"{one / 64 * 1e6:.1f} microseconds per step of a cell; balance {balance:.1e}")

    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6, 4), layout="constrained")
    for k, name in enumerate(("bottom: cells, 2 MPa", "middle: cells, 4 MPa", "top: elastic")):
        points = [(-rows[k]["strain"], -rows[k]["stress"] / 1e3) for _, rows in curve]
        line, = axes.plot(*np.transpose([(0, 0), *points]), "o-", label=name)
        reach = points[-1][0]
        axes.plot([0, reach], [0, small[k]["modulus"] * reach / 1e3], ":", color=line.get_color())
    axes.set(xlabel="compressive strain of the layer", ylabel="stress, kPa (dotted: E_oed times strain)")
    axes.legend(frameon=False)
    figure.savefig(options.output / "column.png", dpi=130)
    coupling.write_page(
        options.output / "column.html", "A column with cells of particles", "Three bricks are compressed; in the lower two, each integration point is a "
        "periodic cell of particles. The set-up of Stránský 2018, section 5.3.", options.output / "column.png",
        [("residual of the ledger of the elements, over the internal work", balance, "1"),
         ("force through the bottom layer, over that through the top", small[0]["stress"] / small[2]["stress"], "1")],
        [(f"stress of the {name} layer at a strain of 1e-4, over E_oed strain", row["stress"] / (row["modulus"] * row["strain"]), "1")
         for name, row in zip(("bottom", "middle", "top"), small)],
        ["column.json", "bricks-*.vtu", "particles-*.vtu"],
    )


if __name__ == "__main__":
    main()
