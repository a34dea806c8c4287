"""in_pyvista.py NAME...: pyvista reads the exports of results: particles, bonds with their values, fragments, at every snapshot."""

import sys

import numpy as np
import pyvista
from expected import Expected

for name in sys.argv[1:]:
    expected = Expected(name)
    # As the book says.
    particles = pyvista.read(f"{name}.particles.vtkhdf")
    assert particles.n_points == len(expected.last[0]["position"]), particles
    # The result itself has the same particles.
    assert pyvista.get_reader(f"{name}.h5", force_ext=".vtkhdf").read().n_points == particles.n_points
    of_particles = pyvista.get_reader(f"{name}.particles.vtkhdf")
    of_bonds = pyvista.get_reader(f"{name}.bonds.vtkhdf")
    assert of_bonds.reader.GetNumberOfSteps() == len(expected.times)
    for k, (spheres, bonds) in enumerate(expected.snapshots):
        of_particles.reader.SetStep(k)
        of_bonds.reader.SetStep(k)
        particles, lines = of_particles.read(), of_bonds.read()
        assert np.array_equal(particles.points, spheres["position"])
        for field in ("radius", "displacement", "damage", "fragment"):
            assert np.array_equal(particles[field], spheres[field]), field
        assert lines.n_cells == len(bonds["ids"]) and set(lines.celltypes) == {pyvista.CellType.LINE}
        for field in ("damage", "normal_force", "shear_force", "opening", "broken"):
            assert np.array_equal(lines.cell_data[field], bonds[field]), field
        assert np.array_equal(lines.cell_data["fragment"], spheres["fragment"][bonds["ids"][:, 0]])
    ends = lines.points.reshape(-1, 2, 3)
    # Positions of the end of a step, in both: to rounding.
    assert np.allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), expected.lengths, rtol=1e-12)
    # The bonds of a breaking specimen open and break, and leave fragments.
    if name == "breaking":
        assert lines.cell_data["broken"].sum() > 20 and lines.cell_data["opening"].max() > 1e-6
        assert len(set(particles["fragment"])) > 1
    plotter = pyvista.Plotter(off_screen=True, window_size=(700, 700))
    plotter.add_mesh(lines, scalars="damage", clim=(0, 1), line_width=3)
    sphere = pyvista.Sphere(theta_resolution=12, phi_resolution=12)
    plotter.add_mesh(particles.glyph(geom=sphere, scale="radius", factor=2, orient=False), opacity=0.15)
    plotter.view_xy() if name == "discs" else plotter.view_xz()
    picture = plotter.screenshot(f"{name}-pyvista.png")
    # Not one color.
    assert np.ptp(picture) > 50
    print(f"pyvista {pyvista.__version__}, {name}: {len(expected.times)} snapshots of {lines.n_cells} bonds")
