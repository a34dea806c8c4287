"""A fast stand-in for the runs of an ensemble."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ._optional import needed
from ._quantities import Reals

if TYPE_CHECKING:
    from ._ensemble import Ensemble

_VARIANCE_LEFT = 1e-4
"""Share of the variance of the curves that principal components may leave; what they leave counts as error."""
_MOST_COMPONENTS = 12


_UNEXPLAINED = 0.7
"""Share of a component's variance that is left at runs left out, above which it counts as noise."""


class _Fit(NamedTuple):
    """The Gaussian process of one component."""

    amplitude: float
    lengths: Reals
    white: float
    offset: float
    spread: float
    alpha: Reals
    inverse: Reals
    #: Errors at each point when it is left out, (n,), and their share of the variance.
    left_out: Reals
    left_out_share: float
    #: The errors over the deviations that the process expects, (n,), and their mean square, at least 1.
    standardized: Reals
    ratio: float


def _fitted(train: Reals, values: Reals) -> _Fit:
    from scipy.optimize import minimize
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    d = train.shape[1]
    kernel = ConstantKernel(1.0, (1e-2, 1e3)) * Matern(np.full(d, 1.0), (0.05, 50.0), nu=2.5) + WhiteKernel(1e-3, (1e-9, 1.0))

    def optimizer(function: Any, start: Any, bounds: Any) -> tuple[Any, Any]:
        # The lengths need not be exact; the leave-out errors judge them.
        found = minimize(function, start, method="L-BFGS-B", jac=True, bounds=bounds, options={"maxiter": 30, "ftol": 1e-5})
        return found.x, found.fun

    process = GaussianProcessRegressor(kernel, optimizer=optimizer, normalize_y=True, random_state=0)
    with warnings.catch_warnings():
        # A length at its bound says that a parameter does not matter.
        warnings.simplefilter("ignore")
        process.fit(train, values)
    fitted = process.kernel_
    lower = np.linalg.inv(process.L_)
    expected = 1.0 / (lower**2).sum(0)
    alpha = process.alpha_.ravel()
    left_out = alpha * expected
    offset, spread = float(process._y_train_mean), float(process._y_train_std)
    return _Fit(
        float(fitted.k1.k1.constant_value),
        np.array(np.broadcast_to(fitted.k1.k2.length_scale, d)),
        float(fitted.k2.noise_level),
        offset,
        spread,
        alpha,
        np.ascontiguousarray(lower.T),
        left_out * spread,
        float(np.mean(left_out**2)),
        left_out / np.sqrt(expected),
        max(1.0, float(np.mean(left_out**2 / expected))),
    )


class Emulator:
    """Gaussian processes of the principal components of the outputs (Higdon et al. 2008, section 2.2), fitted by scikit-learn.

    The outputs are scaled by their ranges and joined: q components explain all but 1e-4 of the variance, at most 12; those that the
    parameters do not explain are left out. Each has the kernel
    Matérn 5/2 with a length per parameter, and white noise. Leave-one-out errors (Rasmussen and Williams 2006, equations 5.10 to 5.12) are
    compared with what the processes expect; where they are larger, the variance is increased to them.
    """

    def __init__(self, ensemble: Ensemble, names: Sequence[str]) -> None:
        needed("sklearn")
        needed("scipy")
        from scipy.stats import norm, t

        outputs = [ensemble.outputs[name] for name in names]
        #: Places of each output in a joined row.
        self.places: dict[str, slice] = {}
        begin = 0
        for one in outputs:
            self.places[one.name] = slice(begin, begin + one.mean.shape[1])
            begin += one.mean.shape[1]
        self.train = np.stack([one.to_unit(ensemble.inputs[:, k]) for k, one in enumerate(ensemble.parameters)], 1)
        joined = np.concatenate([one.mean for one in outputs], 1)
        # Curves of many points and single numbers count alike.
        scale = np.concatenate([np.full(one.mean.shape[1], (np.ptp(one.mean) or 1.0) * np.sqrt(one.mean.shape[1])) for one in outputs])
        self.center = joined.mean(0)
        scaled = (joined - self.center) / scale
        left, size, right = np.linalg.svd(scaled, full_matrices=False)
        n = len(joined)
        total = float((size**2).sum())
        rest = total - np.cumsum(size**2)
        most = min(int(np.searchsorted(-rest, -_VARIANCE_LEFT * total)) + 1 if total > 0 else 1, _MOST_COMPONENTS, len(size))
        fits = [_fitted(self.train, left[:, k] * np.sqrt(n)) for k in range(most)]
        # A component that the inputs do not explain is noise.
        kept = [k for k in range(most) if k == 0 or fits[k].left_out_share < _UNEXPLAINED]
        #: Principal components, of deviation one over the ensemble, (q, m).
        self.basis: Reals = right[kept] * scale * size[kept, None] / np.sqrt(n)
        residual = (scaled - (left[:, kept] * size[kept]) @ right[kept]) * scale
        #: Rows whose sum of squares is the covariance of what the components leave.
        self.truncation: Reals = residual / np.sqrt(n)
        dofs = max(ensemble.degrees_of_freedom, 1)
        #: Rows whose sum of squares is the covariance of single packings about their mean.
        self.scatter: Reals = np.concatenate([one.deviations for one in outputs], 1) / np.sqrt(dofs)
        if ensemble.degrees_of_freedom:
            # All points have the same few packings. Intervals of 90 % are then those of Student's distribution.
            self.scatter *= t.ppf(0.95, max(ensemble.repeats - 1, 1)) / norm.ppf(0.95)
        self.repeated = ensemble.degrees_of_freedom > 0
        #: All points have the same few packings, whose mean is not that of all packings: this share of the scatter is its variance.
        self.share_of_mean = 1 / ensemble.repeats if self.repeated else 0.0

        fits = [fits[k] for k in kept]
        self.ratios: Reals = np.array([one.ratio for one in fits])
        self.spread: Reals = np.array([one.spread for one in fits])
        self.offset: Reals = np.array([one.offset for one in fits])
        self.amplitude: Reals = np.array([one.amplitude for one in fits])
        #: Variance of the white noise, (q,).
        self.white: Reals = np.array([one.white for one in fits]) * self.ratios * self.spread**2
        self.lengths, self.alpha = np.array([one.lengths for one in fits]), np.array([one.alpha for one in fits])[:, :, None]
        self.inverse = np.array([one.inverse for one in fits])
        # One mistake, such as a peak at the wrong strain, is in several components.
        standardized = np.stack([one.standardized for one in fits], 1)
        together = standardized.T @ standardized / n
        deviations = np.sqrt(np.diag(together))
        q = len(fits)
        #: Square root of the correlation of the components' errors, shrunk toward independence, (q, q).
        self.mixing: Reals = np.linalg.cholesky((together / np.outer(deviations, deviations) * n + np.eye(q) * q) / (n + q))
        #: Errors of the emulator at each point when it is left out, in SI units, (n, m).
        self.left_out: Reals = np.stack([one.left_out for one in fits], 1) @ self.basis + residual
        self._train = self.train[None] / self.lengths[:, None]
        self._squares = (self._train**2).sum(2)

    def components(self, fractions: Any) -> tuple[Reals, Reals]:
        """Means and variances of the components at points in the unit cube, (p, d): two arrays (p, q), without the white noise."""
        at = np.asarray(fractions, np.float64)[None] / self.lengths[:, None]
        square = (at * at).sum(2)[:, :, None] + self._squares[:, None] - 2 * at @ self._train.transpose(0, 2, 1)
        distance = np.sqrt(5.0 * np.maximum(square, 0.0))
        kernel = (1.0 + distance + distance * distance / 3.0) * np.exp(-distance)
        kernel *= self.amplitude[:, None, None]
        mean = self.offset[:, None] + self.spread[:, None] * (kernel @ self.alpha)[:, :, 0]
        explained = kernel @ self.inverse
        variance = self.amplitude[:, None] - np.einsum("qpn,qpn->qp", explained, explained)
        return mean.T, (np.maximum(variance, 1e-12) * (self.spread**2 * self.ratios)[:, None]).T

    def outputs(self, fractions: Any) -> Reals:
        """Means of all outputs at points in the unit cube, joined, SI units, (p, m)."""
        found: Reals = self.center + self.components(fractions)[0] @ self.basis
        return found
