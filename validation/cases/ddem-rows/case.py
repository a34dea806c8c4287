"""Rows of deformable discs: 1/k = 1/k_n + 2/k_p between centers, k_p = πE/2(1−ν²) in plane strain, πE/2 in plane stress
(Madan 2019, eqs. 2.67, 2.72)."""
import math

import numpy as np
from concordem_validate.quantity import si
from concordem_validate.result import Result


def analytic(task):
    material = task.scenario["material"][0]
    stiffness = si(material["linear_bond"]["normal_stiffness"])
    compliance = 1 / stiffness
    if "deformable" in material:
        e, nu = si(material["deformable"]["young"]), si(material["deformable"]["poisson"])
        own = math.pi * e / 2 / (1 - nu**2 if task.scenario["deformable"]["condition"] == "plane-strain" else 1)
        compliance += 2 / own
    result = Result("analytic", task.start.dt)
    force = si(task.scenario["force"][0]["force"][0])
    result.numbers["measures"] = {"shortening": (len(task.start.radius) - 1) * force * compliance}
    return result


def measures(task, result):
    moved = result.series["position"].values[-1] - result.series["position"].values[0]
    x = result.series["position"].values[0]
    if task.variant != "bar":
        return {"shortening": float(moved[0, 0] - moved[-1, 0])}
    # between the end rows, and between the side columns in the middle half of the bar
    low, high = x[:, 1] == x[:, 1].min(), x[:, 1] == x[:, 1].max()
    shortening = moved[low, 1].mean() - moved[high, 1].mean()
    height, width = np.ptp(x[:, 1]), np.ptp(x[:, 0])
    middle = np.abs(x[:, 1] - x[:, 1].mean()) < height / 4
    left, right = middle & (x[:, 0] == x[:, 0].min()), middle & (x[:, 0] == x[:, 0].max())
    widening = moved[right, 0].mean() - moved[left, 0].mean()
    return {"bar_shortening": float(shortening), "bar_poisson": float((widening / width) / (shortening / height)),
            "energy_contacts": float(result.series["stored_normal"].values[-1]),
            "energy_discs": float(result.series["stored_deformation"].values[-1])}
