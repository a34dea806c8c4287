"""python3 read_lines.py FILE...: the lines of VTK PolyData as VTK reads them, as JSON: time, ends of the lines, and fields. Needs the package vtk."""

import json
import sys

import vtk
from vtk.util.numpy_support import vtk_to_numpy


def read(path):
    vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_ERROR)
    reader = vtk.vtkXMLPolyDataReader()
    problems = []
    reader.AddObserver("ErrorEvent", lambda *_: problems.append(path))
    if not reader.CanReadFile(path):
        sys.exit(f"{path} is not taken for PolyData")
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    if problems or grid.GetNumberOfCells() != grid.GetNumberOfLines():
        sys.exit(f"{path}: VTK does not read it")
    ends = []
    for k in range(grid.GetNumberOfCells()):
        line = grid.GetCell(k).GetPointIds()
        ends.append([x for p in range(line.GetNumberOfIds()) for x in grid.GetPoint(line.GetId(p))])
    fields = grid.GetCellData()
    of = {fields.GetArrayName(k): vtk_to_numpy(fields.GetArray(k)).tolist() for k in range(fields.GetNumberOfArrays())}
    return {"time": vtk_to_numpy(grid.GetFieldData().GetArray("TimeValue")).tolist(), "ends": ends, "fields": of}


print(json.dumps([read(path) for path in sys.argv[1:]]))
