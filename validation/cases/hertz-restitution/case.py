"""Restitution of impacts equals the given coefficient."""
import numpy as np
from concordem_validate.quantity import si
from concordem_validate.result import Result


def analytic(task):
    result = Result("analytic", task.start.dt)
    wanted = [si(m["hertz_mindlin"]["restitution"]) for m in task.scenario["material"]]
    result.numbers["measures"] = {"restitution": wanted}
    return result


def measures(task, result):
    x = result.series["position"].values
    gap = x[:, 1::2, 0] - x[:, 0::2, 0]
    speed = np.diff(gap, axis=0)
    return {"restitution": (-speed[-1] / speed[0]).tolist()}
