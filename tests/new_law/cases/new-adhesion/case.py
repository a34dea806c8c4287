"""The energy that the pull-off takes."""
import math

from concordem_validate.quantity import si
from concordem_validate.result import Result


def analytic(task):
    law, start = task.scenario["material"][0]["adhesive"], task.start
    mass = start.mass.prod() / start.mass.sum()
    before = start.velocity[0, 0] - start.velocity[1, 0]
    result = Result("analytic", start.dt)
    taken = si(law["pull_off_force"]) ** 2 / si(law["normal_stiffness"])
    result.numbers["measures"] = {"parting_speed": math.sqrt(before**2 - taken / mass)}
    return result


def measures(task, result):
    at = result.series["position"]
    last = (at.values[-1] - at.values[-2]) / ((at.steps[-1] - at.steps[-2]) * result.dt)
    return {"parting_speed": float(last[1, 0] - last[0, 0])}
