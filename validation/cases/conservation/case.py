"""Conservation of momentum, angular momentum, and energy, and the rotation of a rigid body."""
import numpy as np
from concordem_validate.quantity import si
from concordem_validate.result import Result

# positions of the fragment's spheres, in diameters
_FRAGMENT = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0), (3, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1), (1, 1, 1)]


def scenario(document):
    packing = document["packing"]
    if packing["kind"] != "fragment":
        return document
    radius, velocity, spin = si(packing["radius"]), np.array(packing["velocity"]), np.array(packing["spin"])
    x = 2 * radius * np.array(_FRAGMENT, float)
    v = velocity + np.cross(spin, x - x.mean(axis=0))
    document["packing"] = {"kind": "spheres", "spheres": [[*map(float, place), radius] for place in x]}
    document["set"] = [{"name": f"p{i}", "selection": {"kind": "ids", "ids": [i]}} for i in range(len(x))]
    document["initial"] = [{"set": f"p{i}", "velocity": v[i].tolist(), "angular_velocity": spin.tolist()} for i in range(len(x))]
    return document


def _rigid(task):
    """Euler's equations of a rigid body of spheres, by fourth-order Runge-Kutta: rotation matrix and angular velocity."""
    start = task.start
    mass, x = start.mass, start.position
    centre = mass @ x / mass.sum()
    arms = x - centre
    own = 0.4 * mass * start.radius**2
    body = np.einsum("p,pk,pk->", mass, arms, arms) * np.eye(3) - np.einsum("p,pi,pj->ij", mass, arms, arms) + own.sum() * np.eye(3)
    momentum = body @ start.angular_velocity[0]
    velocity = mass @ start.velocity / mass.sum()

    def rate(turn):
        w = np.linalg.solve(turn @ body @ turn.T, momentum)
        return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]) @ turn

    steps, interval = task.scenario["stop"]["steps"], task.scenario["output"]["snapshot_interval"]
    turn, at, places = np.eye(3), [], []
    substeps = 20
    h = start.dt * interval / substeps
    for step in range(0, steps + 1, interval):
        at.append(step)
        places.append(centre + velocity * step * start.dt + arms @ turn.T)
        for _ in range(substeps):
            a = rate(turn)
            b = rate(turn + 0.5 * h * a)
            c = rate(turn + 0.5 * h * b)
            d = rate(turn + h * c)
            turn = turn + h / 6 * (a + 2 * b + 2 * c + d)
    return np.array(at), np.array(places)


def analytic(task):
    result = Result("analytic", task.start.dt)
    result.numbers["measures"] = {
        "momentum_drift": 0.0, "angular_momentum_drift": 0.0, "energy_drift": 0.0, "residual": 0.0, "collided": 1.0}
    if task.variant == "one-fragment":
        result.add("position", *_rigid(task), "m")
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
    # the first cluster moved toward the second and was reflected or deflected
    one = mass[:half] @ v[:, :half]
    return {
        "momentum_drift": float(np.linalg.norm(momentum - momentum[0], axis=1).max() / size),
        "angular_momentum_drift": float(np.linalg.norm(spin - spin[0], axis=1).max() / np.linalg.norm(spin[0])),
        "energy_drift": float(np.abs(energy - energy[0]).max() / energy[0]),
        "residual": float(np.abs(result.series["residual"].values).max() / energy[0]),
        "collided": float(np.linalg.norm(one[-1] - one[0]) > 0.5 * np.linalg.norm(one[0]))}
