"""Read a result file with VTK and compare everything under /VTKHDF with the contents of the file.

Usage: python3 tests/vtk_readback.py FILE   with a result or an export of particles or bonds   (needs the packages vtk >= 9.3, h5py, and numpy)

Exit status 0: VTK reads geometry, fields, and time steps exactly. Otherwise the differences are printed.
The comparison is exact, because VTK only copies the numbers.
"""

import sys

import h5py
import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy


def expect(condition, message):
    if not condition:
        sys.exit(f"vtk_readback: {message}")


def expected_steps(path):
    """The steps according to the arrays in the file: time, points, fields, and number of points of a cell.

    Particles are vertices with fields of points, bonds are lines with fields of cells."""
    with h5py.File(path) as file:
        group = file["VTKHDF"]
        steps = group["Steps"]
        of = "CellData" if "CellData" in group else "PointData"
        for k in range(steps.attrs["NSteps"]):
            part = steps["PartOffsets"][k]
            points, cells = group["NumberOfPoints"][part], group["NumberOfCells"][part]
            start = steps["PointOffsets"][k]
            fields = {}
            for name, values in group[of].items():
                offset = steps[of + "Offsets"][name][k]
                fields[name] = values[offset : offset + cells]
            yield steps["Values"][k], group["Points"][start : start + points], fields, points // cells


def main(path):
    vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_ERROR)
    reader = vtk.vtkHDFReader()
    expect(reader.CanReadFile(path), f"{path} is not taken for VTKHDF")
    reader.SetFileName(path)
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()) or ()
    steps = list(expected_steps(path))
    expect(len(steps) > 0, "the file has no time steps")
    expect(list(times) == [step[0] for step in steps], f"times {times} differ")
    # From the last step to the first, to detect a reader that ignores the requested time.
    for time, points, fields, each in reversed(steps):
        reader.UpdateTimeStep(time)
        grid = reader.GetOutput()
        expect(grid.GetClassName() == "vtkUnstructuredGrid", f"the data set is a {grid.GetClassName()}")
        expect(grid.GetNumberOfPoints() == len(points), f"{grid.GetNumberOfPoints()} points at t = {time}")
        cells = len(points) // each
        expect(grid.GetNumberOfCells() == cells, f"{grid.GetNumberOfCells()} cells at t = {time}")
        read = vtk_to_numpy(grid.GetPoints().GetData())
        expect(read.dtype == points.dtype, f"points are {read.dtype}, not {points.dtype}")
        expect(numpy.array_equal(read, points), f"points differ at t = {time}")
        kind = vtk.VTK_LINE if each == 2 else vtk.VTK_VERTEX
        for cell in (0, cells - 1):
            expect(grid.GetCellType(cell) == kind, f"cell {cell} is of the type {grid.GetCellType(cell)}")
            places = [grid.GetCell(cell).GetPointId(k) for k in range(each)]
            expect(places == [each * cell + k for k in range(each)], f"cell {cell} is at the points {places}")
        data = grid.GetCellData() if each == 2 else grid.GetPointData()
        names = {data.GetArrayName(k) for k in range(data.GetNumberOfArrays())}
        expect(names == set(fields), f"fields {sorted(names)} instead of {sorted(fields)}")
        for name, values in fields.items():
            read = vtk_to_numpy(data.GetArray(name))
            expect(read.shape == values.shape, f"{name} has the shape {read.shape} instead of {values.shape}")
            expect(numpy.array_equal(read, values, equal_nan=values.dtype.kind == "f"), f"{name} differs at t = {time}")
    version = vtk.vtkVersion().GetVTKVersion()
    print(f"VTK {version} read {len(steps)} steps of {len(steps[0][1]) // steps[0][3]} cells with {', '.join(sorted(fields))}")


if __name__ == "__main__":
    expect(len(sys.argv) == 2, "name one result file")
    main(sys.argv[1])
