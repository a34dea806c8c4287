"""Exact stiffness of lattices of unit spacing."""
import itertools

import numpy as np
from concordem_validate.result import Result


def stiffness(lattice, kn, ks):
    """C_ijkl from the sum over the bonds of one particle, each shared by two particles."""
    if lattice == "sc":
        directions, volume = [np.eye(3)[k] * s for k in range(3) for s in (1, -1)], 1.0
    else:
        directions = []
        for a, b in itertools.combinations(range(3), 2):
            for s, t in itertools.product((1, -1), repeat=2):
                n = np.zeros(3)
                n[a], n[b] = s, t
                directions.append(n / np.sqrt(2))
        volume = 1 / np.sqrt(2)
    c, d = np.zeros((3, 3, 3, 3)), np.eye(3)
    for n in directions:
        nnnn = np.einsum("i,j,k,l->ijkl", n, n, n, n)
        sym = 0.25 * (np.einsum("i,k,jl->ijkl", n, n, d) + np.einsum("i,l,jk->ijkl", n, n, d)
                      + np.einsum("j,k,il->ijkl", n, n, d) + np.einsum("j,l,ik->ijkl", n, n, d))
        c += 0.5 / volume * (kn * nnnn + ks * (sym - nnnn))
    return [float(c[0, 0, 0, 0]), float(c[0, 0, 1, 1]), float(c[1, 2, 1, 2])]


def _constants(c11, c12, c44):
    """C11, C12, C44, K, E, ν along a cube axis."""
    return [c11, c12, c44, (c11 + 2 * c12) / 3, c11 - 2 * c12**2 / (c11 + c12), c12 / (c11 + c12)]


def analytic(task):
    law = task.scenario["material"][0]["linear_bond"]
    values = _constants(*stiffness(task.scenario["packing"]["lattice"], law["normal_stiffness"], law["shear_stiffness"]))
    result = Result("analytic", 1.0)
    result.numbers["measures"] = {"static": values, "affine": values, "constants": values}
    return result


def measures(task, result):
    data = result.numbers["elastic"]
    network, affine = (np.array(data[name]["stiffness_pa"]) for name in ("static", "affine"))
    pick = lambda c: _constants(float(c[0, 0]), float(c[0, 1]), float(c[3, 3]))
    return {"static": pick(network), "affine": pick(affine), "constants": pick(network)}
