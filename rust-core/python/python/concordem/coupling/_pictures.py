"""Files for pictures."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Mapping

import numpy as np
from numpy.typing import ArrayLike

from .._errors import CouplingError

# VTK's numbers of cell types by nodes per cell: vertex, triangle, (quadrilateral or tetrahedron), hexahedron.
_KINDS = {("vertex", 1): 1, ("triangle", 3): 5, ("quad", 4): 9, ("tetra", 4): 10, ("hexahedron", 8): 12}


def write_vtk(
    path: str | PathLike[str],
    points: ArrayLike,
    cells: ArrayLike | None = None,
    kind: str = "vertex",
    point_data: Mapping[str, ArrayLike] | None = None,
    cell_data: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Write points and cells to a VTK file (.vtu, XML, text), which ParaView and VTK read.

    Args: `points` (n, 3), m; `cells` (m, nodes), none for particles; `kind`: "vertex", "triangle", "quad", "tetra", or "hexahedron" with
    the nodes in VTK's order (of scikit-fem's hexahedra ``mesh.t.T[:, [6, 2, 0, 3, 7, 4, 1, 5]]``); data with one row per point or cell,
    (n,), (n, 3), or (n, 9).
    """
    places = np.asarray(points, dtype=float)
    nodes = np.arange(len(places))[:, None] if cells is None else np.asarray(cells)
    if (kind, nodes.shape[1]) not in _KINDS:
        raise ValueError(f'cells of kind "{kind}" with {nodes.shape[1]} nodes; known: {sorted(_KINDS)}')
    if not np.isfinite(places).all():
        raise CouplingError("a position is not finite; nothing was written", "NotFinite")

    def array(name: str, values: ArrayLike, kind: str = "Float64") -> str:
        data = np.asarray(values)
        if kind == "Float64":
            # 17 digits bring back every bit.
            text = " ".join(f"{value:.17g}" for value in data.astype(float).ravel())
        else:
            text = " ".join(str(int(value)) for value in data.ravel())
        components = 1 if data.ndim == 1 else data.shape[1]
        return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="ascii">{text}</DataArray>\n'

    def block(tag: str, data: Mapping[str, ArrayLike] | None, count: int) -> str:
        text = ""
        for name, values in (data or {}).items():
            if len(np.asarray(values)) != count:
                raise ValueError(f"{name} has {len(np.asarray(values))} rows; give {count}")
            text += array(name, np.asarray(values, dtype=float).reshape(count, -1).squeeze(axis=1) if np.ndim(values) == 1 else
                          np.asarray(values, dtype=float).reshape(count, -1))
        return f"<{tag}>\n{text}</{tag}>\n"

    count = len(nodes)
    text = (
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian">\n<UnstructuredGrid>\n'
        f'<Piece NumberOfPoints="{len(places)}" NumberOfCells="{count}">\n<Points>\n{array("Points", places)}</Points>\n<Cells>\n'
        + array("connectivity", nodes, "Int64").replace(f'NumberOfComponents="{nodes.shape[1]}"', 'NumberOfComponents="1"')
        + array("offsets", np.arange(1, count + 1) * nodes.shape[1], "Int64")
        + array("types", np.full(count, _KINDS[kind, nodes.shape[1]]), "UInt8")
        + "</Cells>\n"
        + block("PointData", point_data, len(places))
        + block("CellData", cell_data, count)
        + "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
    )
    Path(path).write_text(text, encoding="utf-8")
