"""Show particles and bonds in OVITO: pip install ovito; python THIS_FILE. Then open the scene that it writes in OVITO, also in OVITO
Basic.

Written by concordem export. The scene shows all snapshots, with particles and bonds colored by damage from 0 to 1. Change BOND_COLOR
to "opening", "normal_force", or another value of the bonds for other colors.
"""

import os

import ovito
from ovito.io import import_file
from ovito.modifiers import ColorCodingModifier, LoadTrajectoryModifier

BOND_COLOR = "damage"

here = os.path.dirname(os.path.abspath(__file__))
# The data file has the bonds; the dumps have the values of all snapshots.
pipeline = import_file(os.path.join(here, @DATA@), atom_style="bpm/sphere")
particles = LoadTrajectoryModifier()
particles.source.load(os.path.join(here, @PARTICLES@))
pipeline.modifiers.append(particles)
pipeline.modifiers.append(ColorCodingModifier(property="damage", start_value=0.0, end_value=1.0))
# The data file does not say whether its box is periodic.
pipeline.source.data.cell_.pbc = (@PERIODIC@, @PERIODIC@, @PERIODIC@)
pipeline.source.data.particles_.vis.scaling = 0.5  # Half the radius, so that bonds are visible.
if @BONDS@:
    bonds = LoadTrajectoryModifier()
    ids = ["Particle Identifiers.1", "Particle Identifiers.2"]
    bonds.source.load(os.path.join(here, @BONDS@), columns=[*ids, @COLUMNS@])
    pipeline.modifiers.append(bonds)
    last = pipeline.compute(pipeline.num_frames - 1)
    values = last.particles.bonds[BOND_COLOR][...]
    start, end = (0.0, 1.0) if BOND_COLOR == "damage" else (float(values.min()), float(values.max()))
    pipeline.modifiers.append(
        ColorCodingModifier(property=BOND_COLOR, operate_on="bonds", start_value=start, end_value=end)
    )
    pipeline.source.data.particles_.bonds_.vis.width = 0.3 * float(last.particles["Radius"][...].mean())
pipeline.add_to_scene()
ovito.scene.save(os.path.join(here, @SCENE@))
