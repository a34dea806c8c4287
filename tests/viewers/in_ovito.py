"""in_ovito.py NAME...: OVITO reads the dumps of results, and the session that the exported script wrote."""

import sys

import numpy as np
import ovito
from expected import Expected
from ovito.io import import_file

for name in sys.argv[1:]:
    expected = Expected(name)
    # The dump of the particles alone.
    pipeline = import_file(f"{name}.dump")
    assert pipeline.num_frames == len(expected.times)
    particles = pipeline.compute(pipeline.num_frames - 1).particles
    assert np.allclose(particles.positions[...], expected.last[0]["position"], rtol=0, atol=1e-15)
    # The session: particles and bonds of every snapshot, colored by damage.
    ovito.scene.load(f"{name}.ovito")
    pipeline = ovito.scene.pipelines[0]
    assert pipeline.num_frames == len(expected.times)
    for k, (spheres, bonds) in enumerate(expected.snapshots):
        data = pipeline.compute(k)
        particles = data.particles
        assert np.allclose(particles.positions[...], spheres["position"], rtol=0, atol=1e-15)
        # OVITO stores radii in single precision.
        assert np.allclose(particles["Radius"][...], spheres["radius"], rtol=1e-6)
        assert np.array_equal(particles["Particle Identifier"][...], spheres["id"] + 1)
        assert np.array_equal(particles["fragment"][...], spheres["fragment"])
        lines = particles.bonds
        assert np.array_equal(particles["Particle Identifier"][...][lines.topology[...]], bonds["ids"] + 1)
        for field in ("damage", "normal_force", "shear_force", "opening", "broken"):
            # OVITO reads decimals with an error of a rounding.
            assert np.allclose(lines[field][...], bonds[field], rtol=1e-15, atol=0), field
        if expected.cells is None:
            assert not any(data.cell.pbc)
        else:
            assert all(data.cell.pbc) and np.allclose(data.cell[:3, :3].T, expected.cells[k], rtol=1e-12, atol=0)
    # Through the periodic border, lines go to the next image: they are as long as the bonds.
    shift = lines["Periodic Image"][...] @ data.cell[:3, :3].T if "Periodic Image" in lines else 0.0
    a, b = (particles.positions[...][lines.topology[:, end]] for end in (0, 1))
    assert np.allclose(np.linalg.norm(b + shift - a, axis=1), expected.lengths, rtol=1e-9)
    colors = lines["Color"][...]
    if name == "breaking":
        assert len(np.unique(colors, axis=0)) > 2
    print(f"OVITO {ovito.version_string}, {name}: {pipeline.num_frames} snapshots of {lines.count} bonds")
