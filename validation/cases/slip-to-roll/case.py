"""u = u₀ − μ g t and ω = 5 μ g t/2r while slipping, u = 5 u₀/7 when rolling, from t = 2 u₀/(7 μ g)."""
import numpy as np
from concordem_validate.quantity import si
from concordem_validate.result import Result


def _constants(task):
    law = task.scenario["material"][0]["frictional"]
    return si(law["friction_coefficient"]), abs(si(task.scenario["integration"]["gravity"][2]))


def analytic(task):
    mu, g = _constants(task)
    u = task.start.velocity[0, 0]
    result = Result("analytic", task.start.dt)
    t = 0.05
    result.numbers["measures"] = {
        "slipping_speed": u - mu * g * t, "slipping_spin": 2.5 * mu * g * t / task.start.radius[0],
        "rolling_speed": 5 * u / 7, "rolling_spin": 5 * u / 7 / task.start.radius[0]}
    return result


def measures(task, result):
    steps = result.series["velocity"].steps
    v, w = result.series["velocity"].values[:, 0, 0], result.series["angular_velocity"].values[:, 0, 1]
    half = 0.5 if result.provenance.get("velocity_at") == "half steps" else 0.0
    t = (steps - half) * result.dt
    end = t >= 0.105
    return {
        "slipping_speed": float(np.interp(0.05, t, v)), "slipping_spin": float(np.interp(0.05, t, w)),
        "rolling_speed": float(v[end].mean()), "rolling_spin": float(w[end].mean())}
