#!/usr/bin/env python3
"""Cracks under a rigid cylinder with both criteria of Jebahi et al. 2015, sections 4.2.4.3 and 4.3.4: docs/book/images/indentation.png.

    .venv/bin/python validation/indentation.py

The test in the book is qualitative (it gives no indenter, size, or rate), so only the positions of the first broken bonds can be
compared. Runs the template `beam-indentation` with both failure criteria; takes about two minutes.
"""

import subprocess
import tempfile
from pathlib import Path

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).resolve().parent.parent
TEMPLATE = ROOT / "rust-core/scenario/src/schema/templates/beam-indentation.toml"
BEAM = 'tensile_strength = "292 MPa"\nbending_term = "mid-section"\n'
CRITERIA = {"strength of beams, 292 MPa": BEAM, "strength of particles, 64 MPa": 'hydrostatic_strength = "64 MPa"\n'}

figure, axes = plt.subplots(2, 2, figsize=(9, 4.9), sharex=True, sharey=True)
for row, (name, criterion) in zip(axes, CRITERIA.items(), strict=True):
    with tempfile.TemporaryDirectory() as folder:
        scenario = Path(folder) / "plate.toml"
        text = TEMPLATE.read_text()
        assert text.count(BEAM) == 1
        scenario.write_text(text.replace(BEAM, criterion))
        subprocess.run([ROOT / "target/release/concordem", "run", "--quiet", scenario], check=True, stdout=subprocess.DEVNULL)
        with h5py.File(scenario.with_suffix(".h5")) as file:
            place, time = file["events/position"][:] * 1e3, file["events/time"][:] * 1e6
    for axis, share in zip(row, (0.3, 1.0), strict=True):
        count = int(share * len(place))
        axis.scatter(place[:count, 0], place[:count, 1], s=2, c=time[:count])
        axis.set(aspect="equal", xlim=(-8, 8), ylim=(-3, 3.3))
        axis.set_title(f"{name}: {count} bonds, {time[count - 1]:.0f} µs", fontsize=8)
figure.supxlabel("mm", fontsize=8)
figure.tight_layout()
figure.savefig(ROOT / "docs/book/images/indentation.png", dpi=90)
