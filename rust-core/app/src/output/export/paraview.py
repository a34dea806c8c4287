"""Show particles and bonds in ParaView: Tools > Python Shell > Run Script, or pvpython --script=THIS_FILE.

Written by concordem export. Particles are spheres colored by damage; bonds are lines colored by damage, broken ones are thick and red.
Change BOND_COLOR to "opening", "normal_force", or "fragment" for other colors.
"""

import os

from paraview.simple import (
    ColorBy,
    GetActiveViewOrCreate,
    GetAnimationScene,
    OpenDataFile,
    Render,
    ResetCamera,
    Show,
    Threshold,
    UpdatePipeline,
)

BOND_COLOR = "damage"

try:
    here = os.path.dirname(os.path.abspath(__file__))
except NameError:  # ParaView's shell does not set __file__.
    here = os.getcwd()

view = GetActiveViewOrCreate("RenderView")

particles = OpenDataFile(os.path.join(here, "PARTICLES"))
UpdatePipeline()
shown = Show(particles, view)
shown.SetRepresentationType("Point Gaussian")
shown.ShaderPreset = "Sphere"
shown.ScaleByArray = 1
shown.SetScaleArray = ["POINTS", "radius"]
shown.UseScaleFunction = 0
shown.GaussianRadius = 1.0
shown.Opacity = 0.3
ColorBy(shown, ("POINTS", "damage"))
shown.RescaleTransferFunctionToDataRange(True, False)

if "BONDS":
    bonds = OpenDataFile(os.path.join(here, "BONDS"))
    UpdatePipeline()
    lines = Show(bonds, view)
    lines.SetRepresentationType("Wireframe")
    ColorBy(lines, ("CELLS", BOND_COLOR))
    lines.SetScalarBarVisibility(view, True)
    broken = Threshold(Input=bonds)
    broken.Scalars = ["CELLS", "broken"]
    broken.LowerThreshold = 0.5
    broken.UpperThreshold = 1.5
    cracks = Show(broken, view)
    cracks.SetRepresentationType("Wireframe")
    cracks.LineWidth = 4.0
    ColorBy(cracks, None)
    cracks.AmbientColor = cracks.DiffuseColor = [0.8, 0.1, 0.1]

GetAnimationScene().UpdateAnimationUsingDataTimeSteps()
GetAnimationScene().GoToLast()
ResetCamera()
Render()
