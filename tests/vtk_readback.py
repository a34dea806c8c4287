"""Read a result file with VTK and compare everything under /VTKHDF with the contents of the file.

Usage: python3 tests/vtk_readback.py RESULT.h5   (needs the packages vtk >= 9.3, h5py, and numpy)

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
    """The steps according to the arrays in the file: time, points, and fields."""
    with h5py.File(path) as file:
        group = file["VTKHDF"]
        steps = group["Steps"]
        for k in range(steps.attrs["NSteps"]):
            count = group["NumberOfPoints"][steps["PartOffsets"][k]]
            start = steps["PointOffsets"][k]
            fields = {}
            for name, values in group["PointData"].items():
                offset = steps["PointDataOffsets"][name][k]
                fields[name] = values[offset : offset + count]
            yield steps["Values"][k], group["Points"][start : start + count], fields


def main(path):
    vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_ERROR)
    reader = vtk.vtkHDFReader()
    expect(reader.CanReadFile(path), f"{path} is not taken for VTKHDF")
    reader.SetFileName(path)
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()) or ()
    steps = list(expected_steps(path))
    expect(len(steps) > 0, "the file has no time steps")
    expect(list(times) == [time for time, _, _ in steps], f"times {times} differ")
    # From the last step to the first, to detect a reader that ignores the requested time.
    for time, points, fields in reversed(steps):
        reader.UpdateTimeStep(time)
        grid = reader.GetOutput()
        expect(grid.GetClassName() == "vtkUnstructuredGrid", f"the data set is a {grid.GetClassName()}")
        expect(grid.GetNumberOfPoints() == len(points), f"{grid.GetNumberOfPoints()} points at t = {time}")
        expect(grid.GetNumberOfCells() == len(points), f"{grid.GetNumberOfCells()} cells at t = {time}")
        read = vtk_to_numpy(grid.GetPoints().GetData())
        expect(read.dtype == points.dtype, f"points are {read.dtype}, not {points.dtype}")
        expect(numpy.array_equal(read, points), f"points differ at t = {time}")
        for cell in (0, len(points) - 1):
            expect(grid.GetCellType(cell) == vtk.VTK_VERTEX, f"cell {cell} is not a vertex")
            expect(grid.GetCell(cell).GetPointId(0) == cell, f"cell {cell} is at another point")
        data = grid.GetPointData()
        names = {data.GetArrayName(k) for k in range(data.GetNumberOfArrays())}
        expect(names == set(fields), f"fields {sorted(names)} instead of {sorted(fields)}")
        for name, values in fields.items():
            read = vtk_to_numpy(data.GetArray(name))
            expect(read.shape == values.shape, f"{name} has the shape {read.shape} instead of {values.shape}")
            expect(numpy.array_equal(read, values, equal_nan=values.dtype.kind == "f"), f"{name} differs at t = {time}")
    version = vtk.vtkVersion().GetVTKVersion()
    print(f"VTK {version} read {len(steps)} steps of {len(steps[0][1])} particles with {', '.join(sorted(fields))}")


if __name__ == "__main__":
    expect(len(sys.argv) == 2, "name one result file")
    main(sys.argv[1])
