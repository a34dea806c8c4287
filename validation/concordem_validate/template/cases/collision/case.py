"""Two equal spheres exchange their velocities."""
from concordem_validate.result import Result


def analytic(task):
    result = Result("analytic", task.start.dt)
    result.numbers["measures"] = {"velocities": task.start.velocity[::-1, 0].tolist()}
    return result


def measures(task, result):
    """Velocities of the last two snapshots."""
    position, time = result.series["position"].values, result.time("position")
    return {"velocities": ((position[-1] - position[-2]) / (time[-1] - time[-2]))[:, 0].tolist()}
