"""Under strain eps along x, a bond of direction n gets the length d sqrt(1 + n_x^2 (2 eps + eps^2)) and breaks if k_n times its elongation exceeds
its strength F.

C11 = sum over bonds of (k_n n_x^4 + k_s n_x^2 (1 - n_x^2)) / (V/d), the affine sum, exact for centrosymmetric lattices.
"""
import itertools
import math

import numpy as np
from concordem_validate.quantity import si
from concordem_validate.result import Result


def _directions(lattice):
    """Unit vectors to the nearest neighbors, one of each pair, and the volume per particle in units of the distance."""
    if lattice == "sc":
        return [(1, 0, 0), (0, 1, 0), (0, 0, 1)], 1.0
    both = [np.array(v) / math.sqrt(2) for v in itertools.product((-1, 0, 1), repeat=3) if np.abs(v).sum() == 2]
    return [v for v in both if tuple(v) > (0, 0, 0)], 1 / math.sqrt(2)


def analytic(task):
    law = task.scenario["material"][0]["linear_bond"]
    kn, ks, strength = (si(law[key]) for key in ("normal_stiffness", "shear_stiffness", "normal_strength"))
    d = 2 * si(task.scenario["packing"]["radius"])
    directions, volume = _directions(task.scenario["packing"]["lattice"])
    # sigma = sum of branch times force per volume; the shear force is k_s times the tangential displacement
    modulus = sum(n[0] ** 2 * (kn * n[0] ** 2 + ks * (1 - n[0] ** 2)) for n in map(np.array, directions)) / (volume * d)
    steepest = max(n[0] ** 2 for n in map(np.array, directions))
    stretch = strength / (kn * d)
    strain = math.sqrt(1 + stretch * (2 + stretch) / steepest) - 1
    result = Result("analytic", 1.0)
    result.numbers["measures"] = {"modulus": modulus, "strain": strain, "strength": modulus * strength / (kn * steepest * d)}
    return result


def measures(task, result):
    series = result.series["whole.stress"]
    stress = series.values[:, 0, 0]
    rate = si(task.scenario["loading"]["velocity_gradient"][0][0])
    # The cell grows by the same factor in every step.
    strain = np.expm1(series.steps * math.log1p(rate * result.dt))
    peak = int(np.argmax(stress))
    low = strain <= 0.2 * strain[peak]
    return {"modulus": float(np.polyfit(strain[low], stress[low], 1)[0]), "strain": float(strain[peak]), "strength": float(stress[peak])}
