"""Balances of a run by itself: what free particles conserve, from positions, velocities, and masses."""
import numpy as np

from . import meeting
from . import start as starts
from .errors import HarnessError, Incomparable


def _of_particles(task, result, name):
    """A value of each particle, from the result, or from the scenario if the result has none, as a table in CSV."""
    if name in result.fields:
        return result.fields[name][0]
    try:
        start = starts.state(task.scenario, task.folder)
    except HarnessError as error:
        raise Incomparable("error", f"the result has no field `{name}`, and the scenario gives none: {error}") from None
    return start.inertia(task.scenario.get("dimension", 3) == 2) if name == "inertia" else start.mass


def _velocity(result):
    return meeting.of(result, "velocity").values


def _momentum(task, result):
    m = _of_particles(task, result, "mass")[:, None]
    v = _velocity(result)
    return (m * v).sum(axis=1), float((m[:, 0] * np.linalg.norm(v, axis=2)).sum(axis=1).max())


def _inertia(task, result):
    """Moments of inertia about each axis, one row per particle; those of a body that is no sphere turn with it, which no series tells."""
    values = np.asarray(_of_particles(task, result, "inertia"), float)
    if values.ndim == 1:
        return values[:, None]
    if task.scenario.get("dimension", 3) != 2 and not np.allclose(values, values[:, :1], rtol=1e-12, atol=0):
        raise Incomparable("error", f"`inertia` of {result.engine} depends on the axis; the balance is for spheres")
    return values


def _angular_momentum(task, result):
    """About the origin, with spins if the result has them. Leapfrog has its velocities half a step before its positions."""
    m, v = _of_particles(task, result, "mass")[:, None], _velocity(result)
    x = meeting.of(result, "position").values
    if not np.array_equal(result.series["position"].steps, result.series["velocity"].steps):
        raise Incomparable("error", "`position` and `velocity` have different steps")
    if result.provenance.get("velocity_at", "half steps") == "half steps":
        x = x - 0.5 * result.dt * v
    each = m * np.cross(x, v)
    if "angular_velocity" in result.series:
        if not np.array_equal(result.series["angular_velocity"].steps, result.series["velocity"].steps):
            raise Incomparable("error", "`angular_velocity` and `velocity` have different steps")
        spins = _inertia(task, result) * meeting.of(result, "angular_velocity").values
    else:
        spins = np.zeros_like(each)
    size = np.linalg.norm(each, axis=2) + np.linalg.norm(spins, axis=2)
    return (each + spins).sum(axis=1), float(size.sum(axis=1).max())


KINDS = {"momentum": _momentum, "angular_momentum": _angular_momentum}


def of(check, task, result):
    """Steps and the change since the start, over the largest sum of sizes."""
    values, size = KINDS[check.of](task, result)
    if len(values) < 2:
        raise Incomparable("short", f"`velocity` of {result.engine} has fewer than two samples")
    if not np.isfinite(values).all():
        raise Incomparable("nan", f"`{check.of}` of {result.engine} is not a finite number")
    if not size > 0:
        raise Incomparable("blind", f"nothing moves, so `{check.of}` says nothing")
    return result.series["velocity"].steps, np.linalg.norm(values - values[0], axis=1) / size
