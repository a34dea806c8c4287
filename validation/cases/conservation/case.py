"""What must not change: momentum, angular momentum, energy."""
import numpy as np
from concordem_validate.result import Result


def analytic(task):
    result = Result("analytic", task.start.dt)
    result.numbers["measures"] = {
        "momentum_drift": 0.0, "angular_momentum_drift": 0.0, "energy_drift": 0.0, "residual": 0.0, "collided": 1.0}
    return result


def measures(task, result):
    mass, radius = result.fields["mass"][0], result.fields["radius"][0]
    x, v, w = (result.series[name].values for name in ("position", "velocity", "angular_velocity"))
    momentum = np.einsum("p,npi->ni", mass, v)
    spin = np.einsum("p,npi->ni", mass, np.cross(x, v)) + np.einsum("p,npi->ni", 0.4 * mass * radius**2, w)
    size = np.sum(mass * np.linalg.norm(v[0], axis=1))
    energy = sum(result.series[name].values for name in (
        "kinetic", "stored_normal", "stored_shear", "stored_bending", "stored_twist"))
    half = len(mass) // 2
    # the first cluster flew towards the second and has come back or turned aside
    one = mass[:half] @ v[:, :half]
    return {
        "momentum_drift": float(np.linalg.norm(momentum - momentum[0], axis=1).max() / size),
        "angular_momentum_drift": float(np.linalg.norm(spin - spin[0], axis=1).max() / np.linalg.norm(spin[0])),
        "energy_drift": float(np.abs(energy - energy[0]).max() / energy[0]),
        "residual": float(np.abs(result.series["residual"].values).max() / energy[0]),
        "collided": float(np.linalg.norm(one[-1] - one[0]) > 0.5 * np.linalg.norm(one[0]))}
