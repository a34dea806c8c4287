"""Bonds of a bonded engine in files for ParaView, in the form of YADE's VTKRecorder.

VTKRecorder reads O.interactions, where the bonds are not. These files have its names and fields. The format is VTK's XML, version 1.0
with 64-bit sizes, data encoded in base64.
"""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from ._interactions import Bonds, table_of
from ._scene import host

_TYPES = {"f": "Float64", "i": "Int64", "u": "UInt8"}


def _array(name: str, values: Any) -> str:
    """One DataArray: reals as 64-bit reals, integers as 64-bit integers, flags as bytes."""
    values = np.asarray(values)
    kind = {"f": "f8", "b": "u1"}.get(values.dtype.kind, "i8")
    data = np.ascontiguousarray(values, "<" + kind)
    components = data.shape[1] if data.ndim > 1 else 1
    raw = data.tobytes()
    text = base64.b64encode(np.array([len(raw)], "<u8").tobytes()) + base64.b64encode(raw)
    label = f' Name="{name}"' if name else ""
    return (
        f'<DataArray type="{_TYPES[data.dtype.kind]}"{label} NumberOfComponents="{components}" format="binary">'
        f"{text.decode()}</DataArray>\n"
    )


def _arrays(fields: dict[str, Any]) -> str:
    return "".join(_array(name, values) for name, values in fields.items())


def _write(path: str, kind: str, piece: str) -> str:
    text = (
        f'<?xml version="1.0"?>\n<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
        f"<{kind}>\n{piece}</{kind}>\n</VTKFile>\n"
    )
    with open(path, "w", encoding="ascii") as file:
        file.write(text)
    return path


def write(engine: Bonds, prefix: str) -> list[str]:
    """See :meth:`BondedEngine.write_vtk`."""
    number = host().omega.iter
    table, now = table_of(engine.solver), engine.solver.bodies()
    return [_write_contacts(f"{prefix}-intrs.{number}.vtp", table, now), _write_spheres(f"{prefix}-spheres.{number}.vtu", table, now)]


def _write_contacts(path: str, table: dict[str, Any], now: dict[str, Any]) -> str:
    count = len(table["a"])
    start = now["position"][table["index_a"]]
    # Line ends come in pairs, so that a contact across a periodic border is drawn to the image.
    ends = np.stack([start, start + table["normal"] * table["length"][:, None]], axis=1).reshape(-1, 3)
    # YADE's forces act on the second body.
    force = -table["force"]
    along = np.einsum("ij,ij->i", force, table["normal"])
    shear = force - along[:, None] * table["normal"]
    fields = {
        "forceN": along,
        "absForceT": np.linalg.norm(shear, axis=1),
        "forceT": shear,
        "moment": -table["moment"],
        "damage": table["damage"],
        "bonded": table["bonded"].astype(bool),
        "law": table["law"],
        "length": table["length"],
        "id1": table["a"],
        "id2": table["b"],
    }
    return _write(
        path,
        "PolyData",
        f'<Piece NumberOfPoints="{2 * count}" NumberOfVerts="0" NumberOfLines="{count}" NumberOfStrips="0" NumberOfPolys="0">\n'
        f"<Points>\n{_array('', ends)}</Points>\n"
        f"<Lines>\n{_array('connectivity', np.arange(2 * count))}{_array('offsets', 2 * np.arange(1, count + 1))}</Lines>\n"
        f"<CellData>\n{_arrays(fields)}</CellData>\n</Piece>\n",
    )


def _write_spheres(path: str, table: dict[str, Any], now: dict[str, Any]) -> str:
    count = len(now["id"])
    bonded = table["bonded"].astype(bool)
    ends = np.concatenate([table[name][bonded] for name in ("index_a", "index_b")])
    bonds = np.bincount(ends, minlength=count)
    damage = np.bincount(ends, np.tile(table["damage"][bonded], 2), count) / np.maximum(bonds, 1)
    fields = {
        "radii": now["radius"],
        "id": now["id"],
        "linVelVec": now["velocity"],
        "angVelVec": now["angular_velocity"],
        "bonds": bonds,
        "damage": damage,
    }
    vertex = np.ones(count, bool)  # VTK's type of a cell with one point
    return _write(
        path,
        "UnstructuredGrid",
        f'<Piece NumberOfPoints="{count}" NumberOfCells="{count}">\n<Points>\n{_array("", now["position"])}</Points>\n'
        f"<Cells>\n{_array('connectivity', np.arange(count))}{_array('offsets', np.arange(1, count + 1))}{_array('types', vertex)}</Cells>\n"
        f"<PointData>\n{_arrays(fields)}</PointData>\n</Piece>\n",
    )
