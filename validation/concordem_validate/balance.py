"""Balances of a run by itself: what free particles conserve, from positions, velocities, and masses."""
import numpy as np

from . import meeting
from . import start as starts
from .errors import HarnessError, Incomparable


def _masses(task, result):
    """Masses of the result, or those that the scenario gives."""
    if "mass" in result.fields:
        return result.fields["mass"][0]
    try:
        return starts.state(task.scenario, task.folder).mass
    except HarnessError as error:
        raise Incomparable("error", f"the result has no field `mass`, and the scenario gives none: {error}") from None


def _velocity(result):
    return meeting.of(result, "velocity").values


def _momentum(task, result):
    m = _masses(task, result)[:, None]
    v = _velocity(result)
    return (m * v).sum(axis=1), float((m[:, 0] * np.linalg.norm(v, axis=2)).sum(axis=1).max())


def _angular_momentum(task, result):
    """About the origin, with spins of solid spheres. Leapfrog has its velocities half a step before its positions."""
    m, v = _masses(task, result)[:, None], _velocity(result)
    x = meeting.of(result, "position").values
    if not np.array_equal(result.series["position"].steps, result.series["velocity"].steps):
        raise Incomparable("error", "`position` and `velocity` have different steps")
    if result.provenance.get("velocity_at", "half steps") == "half steps":
        x = x - 0.5 * result.dt * v
    whole = (m * np.cross(x, v)).sum(axis=1)
    if "angular_velocity" in result.series and "radius" in result.fields:
        inertia = 0.4 * m * result.fields["radius"][0][:, None] ** 2
        whole = whole + (inertia * result.series["angular_velocity"].values).sum(axis=1)
    return whole, float((m[:, 0] * np.linalg.norm(np.cross(x, v), axis=2)).sum(axis=1).max())


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
