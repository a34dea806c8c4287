"""What a viewer must show of a result: read from the result itself, with h5py."""

import h5py
import numpy as np


class Expected:
    """Particles and bonds of all snapshots."""

    def __init__(self, name):
        with h5py.File(f"{name}.h5") as file:
            grid, bonds = file["VTKHDF"], file["bonds"]
            steps = grid["Steps"]
            self.times = steps["Values"][:]
            count = int(grid["NumberOfPoints"][0])
            self.snapshots = []
            for k in range(len(self.times)):
                first = int(steps["PointOffsets"][k])
                particles = {"position": grid["Points"][first : first + count]}
                for field, values in grid["PointData"].items():
                    first = int(steps[f"PointDataOffsets/{field}"][k])
                    particles[field] = values[first : first + count]
                lines = {}
                for field, values in bonds.items():
                    if field != "Steps":
                        first = int(bonds[f"Steps/offset_{field}"][k])
                        lines[field] = values[first : first + int(bonds["Steps/count"][k])]
                self.snapshots.append((particles, lines))
            # Edge vectors of the periodic cell as rows, of every snapshot.
            self.cells = steps["cell"][:].reshape(-1, 3, 3) if "cell" in steps else None
            # Length of every bond in the final state, in the order of the ids.
            law = next(law for law in file["contacts"] if not law.startswith("unbonded_") and law != "walls")
            table = file["contacts"][law]
            order = np.lexsort(table["ids"][:].T[::-1])
            self.lengths = np.linalg.norm(table["branch"][:], axis=1)[order]

    @property
    def last(self):
        return self.snapshots[-1]
