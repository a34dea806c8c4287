"""What a measurement does not determine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from ._quantities import Reals

if TYPE_CHECKING:
    from ._ensemble import Ensemble

_UNDETERMINED = 0.8
"""Deviation over the prior's, on the scale of the parameter, above which a parameter counts as not determined."""
_UNSEEN = 0.05
"""Share of the information of single parameters below which a change of several counts as unseen: of two, a correlation of 0.95."""
_BY_PRIOR = 0.25
"""Share of the prior in what is known about an unseen change from which it counts: its deviation is half of the prior's."""
_TAKES_PART = 0.1
"""Part of two parameters in the unseen changes from which they belong together; of n that act as a product it is 1/n."""
_EDGE, _EDGE_SHARE = 0.05, 0.3
"""A share of the samples above the second number in the outer range of the first says that the range ends too early."""
_NUMBERS = {1: "one", 2: "two", 3: "three"}
_IMPROBABLE = 0.005
"""Probability of so bad a fit below which the ensemble counts as unable to give the curve."""


def deviation_of(density: Callable[[Reals], Reals] | None) -> float:
    """Standard deviation of a prior on the unit range, from the logarithm of its density; None is uniform."""
    if density is None:
        return float(12**-0.5)
    grid = np.linspace(0.0, 1.0, 1001)
    weight = density(grid)
    weight = np.exp(weight - weight.max())
    weight /= weight.sum()
    return float(np.sqrt((weight * grid**2).sum() - (weight * grid).sum() ** 2))


def groups_of(information: Reals, priors: Reals) -> list[tuple[list[int], int]]:
    """Groups of parameters that are determined only together, and how many of each group to fix.

    `information` is that of the measurement at points of the posterior, (p, d, d), `priors` the deviations of the priors, (d,). Scaled to a diagonal of
    one, the eigenvectors of the whole information with small eigenvalues are changes of several parameters that the measurement hardly sees (Belsley, Kuh and
    Welsch 1980, chapter 3). They count where most of what is known about them comes from the prior, and are found point by point, because they turn where
    parameters act as a product.
    """
    whole = information + np.diag(priors**-2)
    scale = 1 / np.sqrt(np.diagonal(whole, axis1=1, axis2=2))
    values, vectors = np.linalg.eigh(whole * scale[:, :, None] * scale[:, None, :])
    of_prior = (vectors**2 * (scale / priors)[:, :, None] ** 2).sum(1) / np.maximum(values, 1e-12)
    unseen = (vectors * ((values < _UNSEEN) & (of_prior > _BY_PRIOR))[:, None, :]) @ vectors.transpose(0, 2, 1)
    joined = np.abs(unseen).mean(0) > _TAKES_PART
    share = np.diagonal(unseen, axis1=1, axis2=2).mean(0)
    groups: list[tuple[list[int], int]] = []
    left = set(np.flatnonzero(joined.sum(1) > 1).tolist())
    while left:
        group, new = set(), {min(left)}
        while new:
            group |= new
            new = set(np.flatnonzero(joined[sorted(new)].any(0)).tolist()) - group
        left -= group
        if len(group) > 1:
            groups.append((sorted(group), min(max(1, round(float(share[sorted(group)].sum()))), len(group) - 1)))
    return groups


def _listed(names: list[str]) -> str:
    quoted = [repr(name) for name in names]
    return f"{quoted[0]} and {quoted[1]}" if len(quoted) == 2 else f"{', '.join(quoted[:-1])}, and {quoted[-1]}"


def notes_on(
    ensemble: Ensemble, fractions: Reals, priors: Reals, information: Reals, errors: Mapping[str, float], misfit: float | None
) -> list[str]:
    """What the measurement does not determine, and where the ensemble does not suffice.

    `fractions` are samples on the unit range, (k, d), `priors` the deviations of the priors there, (d,), `information` that of the measurement
    at some samples, (p, d, d).
    """
    found = []
    grouped: set[int] = set()
    for group, fix in groups_of(information, priors):
        grouped |= set(group)
        names = [ensemble.names[k] for k in group]
        found.append(
            f"{_listed(names)} are not told apart, only {'a combination' if fix == len(group) - 1 else 'combinations'} of them "
            f"{'is' if fix == len(group) - 1 else 'are'} determined; fix {_NUMBERS.get(fix, fix)} of them, or measure what separates them"
        )
    for k, one in enumerate(ensemble.parameters):
        deviation = float(fractions[:, k].std())
        if deviation > _UNDETERMINED * priors[k]:
            if k not in grouped:
                found.append(
                    f"{one.name!r} is not determined by this measurement: its deviation is {deviation / priors[k]:.0%} of the prior's; fix it, or measure more"
                )
            continue
        for share, end, bound in ((np.mean(fractions[:, k] < _EDGE), "lower", one.low), (np.mean(fractions[:, k] > 1 - _EDGE), "upper", one.high)):
            if share > _EDGE_SHARE:
                found.append(f"{one.name!r} lies at the {end} end of its range, {bound:g}; run the ensemble with a wider range")
    for name, ratio in errors.items():
        if ratio > 1:
            found.append(f"the emulator of {name!r} errs by {ratio:.2g} times noise and scatter at runs left out; add runs, or narrow the ranges")
    if misfit is not None and misfit < _IMPROBABLE:
        found.append(
            f"no parameters in the ranges give the measured values within the noise (probability {misfit:.1g}); widen the ranges, give the noise its true "
            "size, or vary another parameter"
        )
    return found
