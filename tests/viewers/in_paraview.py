"""in_paraview.py NAME: runs the exported macro in ParaView (pvpython) and looks at what it shows. Writes NAME-paraview.png."""

import os
import runpy
import sys

from paraview.simple import GetActiveView, GetParaViewVersion, GetSources, GetTimeKeeper, SaveScreenshot, servermanager

name = sys.argv[1]
runpy.run_path(os.path.abspath(f"{name}.paraview.py"))
sources = {key[0]: source for key, source in GetSources().items()}
# ParaView numbers them in the order of the macro.
particles, bonds, threshold = (sources[key] for key in ("VTKHDFReader1", "VTKHDFReader2", "Threshold1"))
view = GetActiveView()
times = list(GetTimeKeeper().TimestepValues)
assert len(times) > 3 and view.ViewTime == times[-1], (times, view.ViewTime)
grids = [servermanager.Fetch(source) for source in (particles, bonds, threshold)]
cells = [grid.GetNumberOfCells() for grid in grids]
data = grids[1].GetCellData()
for field in ("damage", "normal_force", "shear_force", "opening", "broken", "fragment"):
    assert data.GetArray(field) is not None, field
broken = data.GetArray("broken")
count = sum(broken.GetValue(k) for k in range(cells[1]))
assert cells[2] == count, (cells, count)
if name == "breaking":
    assert count > 20
view.ViewSize = [700, 700]
SaveScreenshot(f"{name}-paraview.png", view)
version = GetParaViewVersion()
print(f"ParaView {version.major}.{version.minor}, {name}: {len(times)} snapshots, {cells[0]} particles, {cells[1]} bonds, {cells[2]} of them broken")
