"""Show particles and bonds in ParaView 5.12 or newer: Tools > Python Shell > Run Script, or pvpython THIS_FILE.

Written by concordem export. Particles are spheres and bonds are lines, both colored by damage from 0 to 1; broken bonds are thick and red.
Change BOND_COLOR to "opening", "normal_force", or "fragment" for other colors.
"""

import os

from paraview.simple import (
    ColorBy,
    GetActiveViewOrCreate,
    GetAnimationScene,
    GetColorTransferFunction,
    OpenDataFile,
    Render,
    ResetCamera,
    Show,
    Threshold,
    UpdatePipeline,
)

BOND_COLOR = "damage"


def color(shown, kind, name):
    """Color by a field, with one range for all times."""
    ColorBy(shown, (kind, name))
    if name == "damage":
        GetColorTransferFunction(name).RescaleTransferFunction(0.0, 1.0)
    else:
        shown.RescaleTransferFunctionToDataRangeOverTime()


try:
    here = os.path.dirname(os.path.abspath(__file__))
except NameError:  # ParaView's shell does not set __file__.
    here = os.getcwd()

view = GetActiveViewOrCreate("RenderView")

particles = OpenDataFile(os.path.join(here, @PARTICLES@))
UpdatePipeline()
shown = Show(particles, view)
shown.SetRepresentationType("Point Gaussian")
shown.ShaderPreset = "Sphere"
shown.ScaleByArray = 1
shown.SetScaleArray = ["POINTS", "radius"]
shown.UseScaleFunction = 0
shown.GaussianRadius = 1.0
shown.Opacity = 0.15
color(shown, "POINTS", "damage")

if @BONDS@:
    bonds = OpenDataFile(os.path.join(here, @BONDS@))
    UpdatePipeline()
    lines = Show(bonds, view)
    lines.SetRepresentationType("Wireframe")
    color(lines, "CELLS", BOND_COLOR)
    lines.SetScalarBarVisibility(view, True)
    broken = Threshold(Input=bonds)
    broken.Scalars = ["CELLS", "broken"]
    broken.LowerThreshold = 0.5
    broken.UpperThreshold = 1.5
    cracks = Show(broken, view)
    cracks.SetRepresentationType("Wireframe")
    cracks.LineWidth = 4.0
    cracks.ColorArrayName = [None, ""]
    cracks.AmbientColor = cracks.DiffuseColor = [0.8, 0.1, 0.1]

GetAnimationScene().UpdateAnimationUsingDataTimeSteps()
GetAnimationScene().GoToLast()
low_x, high_x, low_y, high_y, low_z, high_z = particles.GetDataInformation().GetBounds()
if high_z - low_z > 0.05 * max(high_x - low_x, high_y - low_y):  # Not in two dimensions, where the view is along z.
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [0.4, -1.0, 0.25], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]
ResetCamera()
Render()
