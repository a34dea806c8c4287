"""Which parameters explain a measured curve, and how surely."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._errors import ConcordemWarning, InferenceError
from ._ensemble import Ensemble, Output
from ._identifiability import deviation_of, notes_on
from ._optional import needed
from ._quantities import Curve, Reals, curve_of, quantity, unit_of

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ._emulator import Emulator

_MOST_POINTS = 1500
_STEP = 1e-3
"""Half the difference for slopes of the emulator, on the unit range: its lengths are above 0.05."""
_POINTS_OF_INFORMATION = 64
"""Samples at which it is asked which parameters act only together."""


class _Datum(NamedTuple):
    """One measured curve or number, beside the output that it belongs to."""

    output: Output
    curve: Curve | None
    values: Reals
    #: From the output's points to the measured ones, (measured, m).
    to_measured: Reals
    #: Covariance of the noise, (measured, measured); of an estimated one, its correlation.
    noise: Reals
    estimated: bool


@dataclass(frozen=True)
class Posterior:
    """Samples of the parameters given a measurement, and what they say."""

    ensemble: Ensemble
    """The ensemble."""
    samples: NDArray[np.void]
    """Samples with one column per parameter, SI units, and ``noise`` if it was estimated, (k,)."""
    warnings: tuple[str, ...]
    """What the measurement does not determine, and where the ensemble does not suffice."""
    effective_samples: float
    """Number of independent samples that say as much."""
    misfit: float | None
    """Probability of a fit at least as bad, if the ensemble is right; None if the noise was estimated."""
    emulator_error: dict[str, float]
    """By output: error of the emulator at runs left out, root mean square, over the deviation of noise and packings."""
    _data: tuple[_Datum, ...] = field(repr=False)
    _fractions: Reals = field(repr=False)
    _emulator: Emulator = field(repr=False)
    _specimens: int = field(repr=False)
    _seed: int = field(repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.ensemble.names

    @property
    def means(self) -> dict[str, float]:
        """Mean of each parameter, SI units."""
        return {name: float(self.samples[name].mean()) for name in self.names}

    @property
    def standard_deviations(self) -> dict[str, float]:
        """Standard deviation of each parameter, SI units."""
        return {name: float(self.samples[name].std()) for name in self.names}

    @property
    def correlation(self) -> Reals:
        """Correlations of the parameters, each on its scale, (d, d)."""
        d = len(self.names)
        found: Reals = np.atleast_2d(np.corrcoef(self._fractions[:, :d].T))
        return found

    def interval(self, probability: float = 0.9) -> dict[str, tuple[float, float]]:
        """By name the range between the quantiles (1 - probability)/2 and (1 + probability)/2, SI units."""
        if not 0 < probability < 1:
            raise InferenceError(f"the probability is {probability}; give a number between 0 and 1, such as 0.9")
        half = 50 * (1 - probability)
        return {name: (float(low), float(high)) for name in self.names for low, high in [np.percentile(self.samples[name], [half, 100 - half])]}

    def to_pandas(self) -> pandas.DataFrame:
        """The samples as a data frame."""
        frame: pandas.DataFrame = needed("pandas").DataFrame({name: self.samples[name] for name in self.samples.dtype.names or ()})
        return frame

    def to_dict(self) -> dict[str, Any]:
        """Means, deviations, intervals, correlations, and warnings, for a JSON file."""
        intervals = self.interval(0.9)
        return {
            "parameters": {
                one.name: {
                    "unit": one.unit,
                    "prior": [one.low, one.high],
                    "scale": one.scale,
                    "mean": self.means[one.name],
                    "standard_deviation": self.standard_deviations[one.name],
                    "interval_90": list(intervals[one.name]),
                }
                for one in self.ensemble.parameters
            },
            "noise": float(self.samples["noise"].mean()) if "noise" in (self.samples.dtype.names or ()) else None,
            "correlation": self.correlation.tolist(),
            "misfit": self.misfit,
            "emulator_error": self.emulator_error,
            "effective_samples": self.effective_samples,
            "warnings": list(self.warnings),
        }

    def _rows(self) -> list[tuple[str, ...]]:
        rows: list[tuple[str, ...]] = [("parameter", "mean", "deviation", "90 % interval", "range", "unit")]
        for one in self.ensemble.parameters:
            low, high = self.interval(0.9)[one.name]
            mean, deviation = self.means[one.name], self.standard_deviations[one.name]
            rows.append((one.name, f"{mean:.4g}", f"{deviation:.2g}", f"{low:.4g} to {high:.4g}", f"{one.low:.4g} to {one.high:.4g}", one.unit or "-"))
        if "noise" in (self.samples.dtype.names or ()):
            noise = self.samples["noise"]
            low, high = np.percentile(noise, [5, 95])
            unit = next(datum.output.unit for datum in self._data if datum.estimated)
            rows.append(("noise", f"{noise.mean():.4g}", f"{noise.std():.2g}", f"{low:.4g} to {high:.4g}", "estimated", unit or "-"))
        return rows

    def summary(self) -> str:
        """A table of the parameters, and the warnings."""
        rows = self._rows()
        widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows]
        return "\n".join([*lines, *(f"warning: {text}" for text in self.warnings)])

    def _repr_html_(self) -> str:
        head, *rows = self._rows()
        table = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
        notes = "".join(f"<li>{escape(text)}</li>" for text in self.warnings)
        return f"<table><tr>{''.join(f'<th>{escape(cell)}</th>' for cell in head)}</tr>{table}</table>" + (f"<ul>{notes}</ul>" if notes else "")

    def predictive(self, name: str | None = None, probability: float = 0.9, noise: bool = True) -> tuple[Reals, Reals, Reals, Reals]:
        """What the posterior expects of another measurement.

        Parameters
        ----------
        name : of the output; default: the first. probability : of the band. noise : with the noise of the measurement.

        Returns
        -------
        x, low, median, high : abscissa of the ensemble (m,) and the band at each of its points, SI units; of a number x is 0.
        """
        datum = self._datum(name)
        half = 50 * (1 - probability)
        if not 0 < probability < 1:
            raise InferenceError(f"the probability is {probability}; give a number between 0 and 1, such as 0.9")
        random = np.random.default_rng(self._seed)
        emulator, place = self._emulator, self._emulator.places[datum.output.name]
        d = len(self.names)
        weights, variance = emulator.components(self._fractions[:, :d])
        variance = variance + emulator.white / (1 if emulator.repeated else self._specimens)
        weights = weights + np.sqrt(variance) * (random.normal(size=weights.shape) @ emulator.mixing.T)
        rows = emulator.center[place] + weights @ emulator.basis[:, place]
        rows += random.normal(size=(len(rows), len(emulator.truncation))) @ emulator.truncation[:, place]
        if emulator.repeated:
            rows += random.normal(size=(len(rows), len(emulator.scatter))) @ emulator.scatter[:, place] * np.sqrt(1 / self._specimens + emulator.share_of_mean)
        if noise:
            size = self.samples["noise"][:, None] if datum.estimated else np.sqrt(np.diag(datum.noise).mean())
            rows += size * random.normal(size=rows.shape)
        low, median, high = np.percentile(rows, [half, 50, 100 - half], axis=0)
        return datum.output.x if datum.output.x is not None else np.zeros(1), low, median, high

    def _datum(self, name: str | None) -> _Datum:
        known = {datum.output.name: datum for datum in self._data}
        if name is None:
            return next((datum for datum in self._data if datum.curve is not None), self._data[0])
        if name not in known:
            raise InferenceError(f"{name!r} was not measured; choose from {', '.join(known)}")
        return known[name]

    def plot(self) -> Figure:
        """Corner plot with matplotlib: distribution of each parameter, and samples of each pair, in the ranges of the ensemble."""
        from ._pictures import corner

        return corner(self)

    def plot_predictive(self, name: str | None = None, axes: Axes | None = None, probability: float = 0.9) -> Axes:
        """The measured curve over the band that the posterior expects of measurements, with matplotlib."""
        from ._pictures import band

        return band(self, name, axes, probability)


def posterior(
    ensemble: Ensemble,
    measured: Any,
    *,
    noise: Any = "estimate",
    correlation_length: float = 0.0,
    priors: Mapping[str, Any] | None = None,
    specimens: int = 1,
    seed: int = 1,
    draws: int = 1000,
) -> Posterior:
    """Compare an ensemble with measurements.

    The likelihood is Gaussian: noise, error of the emulator, and scatter of the packings add up to its covariance (Kennedy and O'Hagan 2001;
    Higdon et al. 2008). Few packings say little about their scatter: it is increased by Student's factor. emcee (Foreman-Mackey et al. 2013)
    samples the posterior by differences of walkers (ter Braak 2006) and stretches (Goodman and Weare 2010).

    Parameters
    ----------
    ensemble : runs that cover the ranges of the parameters.
    measured : of an ensemble with one output a :class:`Curve`, a CSV file (see :meth:`Curve.from_csv`), ``(x, y)`` in SI units, or a number; else a
        dictionary of these by the name of the output. Numbers may have units: ``{"f_t": "3.1 MPa"}``. Outputs that are not named are not compared.
    noise : standard deviation of the measurement: a number in SI units, a text such as ``"0.1 MPa"``, an array per measured point, a covariance matrix, or
        "estimate" (one curve at most). A dictionary by the name of the output where several are measured.
    correlation_length : of the noise along the abscissa, SI unit; 0: points are independent. A curve with thousands of points is no thousand
        measurements: give this length, or thin the curve.
    priors : distributions of `scipy.stats` by the name of the parameter, cut at its range; default: uniform on the scale of the parameter.
    specimens : number of specimens of which the measured values are the mean; the scatter of packings is divided by it.
    seed : of the sampler; equal seeds give equal numbers. draws : number of effective samples to reach.

    Returns
    -------
    Posterior : its `warnings` also go to :class:`~concordem.ConcordemWarning`.

    Raises
    ------
    InferenceError : measurements, noise, or priors that do not fit. ImportError : an optional package is missing.

    >>> import numpy as np
    >>> from concordem.inference import Ensemble, posterior
    >>> ensemble = Ensemble.from_model(lambda values: {"area": values["a"] ** 2}, {"a": (1, 3)}, count=16)
    >>> found = posterior(ensemble, 4.0, noise=0.1)
    >>> abs(found.means["a"] - 2.0) < 0.05
    True
    """
    if not isinstance(ensemble, Ensemble):
        raise InferenceError(f"the ensemble is a {type(ensemble).__name__}; make one by Ensemble.from_sweep, run, from_model, or from_arrays")
    if not isinstance(specimens, int) or specimens < 1:
        raise InferenceError(f"specimens is {specimens}; give how many specimens the measured values are the mean of, at least 1")
    if not isinstance(draws, int) or draws < 100:
        raise InferenceError(f"draws is {draws}; give at least 100")
    data = _data_of(ensemble, measured, noise, correlation_length)
    emulator = ensemble.emulator([datum.output.name for datum in data])
    densities = _densities(ensemble, priors or {})
    likelihood = _Likelihood(emulator, data, specimens)
    d = len(ensemble.parameters)

    def log_probability(points: Reals) -> Reals:
        found = np.full(len(points), -np.inf)
        inside = ((points >= 0) & (points <= 1)).all(1)
        if inside.any():
            at = points[inside]
            values = likelihood(at)
            for k, density in enumerate(densities):
                if density is not None:
                    values = values + density(at[:, k])
            found[inside] = np.where(np.isnan(values), -np.inf, values)
        return found

    fractions, effective = _sample(log_probability, d + likelihood.estimated, seed, draws)
    columns = {one.name: one.from_unit(fractions[:, k]) for k, one in enumerate(ensemble.parameters)}
    if likelihood.estimated:
        columns["noise"] = likelihood.noise_at(fractions[:, d])
    samples = np.empty(len(fractions), [(name, np.float64) for name in columns])
    for name, values in columns.items():
        samples[name] = values
    errors = likelihood.emulator_errors(float(np.median(columns["noise"])) if likelihood.estimated else 0.0)
    misfit = None if likelihood.estimated else likelihood.misfit(fractions[np.argmax(log_probability(fractions))])
    priors_on_unit = np.array([deviation_of(density) for density in densities])
    some = fractions[:: max(1, len(fractions) // _POINTS_OF_INFORMATION)]
    notes = notes_on(ensemble, fractions[:, :d], priors_on_unit, likelihood.information(some), errors, misfit)
    if 0 < ensemble.degrees_of_freedom and ensemble.repeats < 3:
        notes.append(f"the scatter of packings is known from {ensemble.repeats:g} packings only, so that intervals are wide; run the ensemble with four or more")
    if effective < 0.5 * draws:
        notes.append(f"the sampler has {effective:.0f} effective samples instead of {draws}: its figures are rough; narrow the ranges, or give priors")
    for text in notes:
        warnings.warn(ConcordemWarning(text), stacklevel=2)
    return Posterior(ensemble, samples, tuple(notes), effective, misfit, errors, tuple(data), fractions, emulator, specimens, seed)


def _data_of(ensemble: Ensemble, measured: Any, noise: Any, correlation_length: float) -> list[_Datum]:
    """Every measurement beside its output."""
    if not isinstance(measured, Mapping):
        if len(ensemble.outputs) > 1:
            curves = [name for name, output in ensemble.outputs.items() if output.x is not None]
            if len(curves) != 1 or isinstance(measured, str) and not Path(measured).suffix:
                raise InferenceError(f"the ensemble has {', '.join(ensemble.outputs)}; say which was measured, as {{'{next(iter(ensemble.outputs))}': ...}}")
            measured = {curves[0]: measured}
        else:
            measured = {next(iter(ensemble.outputs)): measured}
    if not measured:
        raise InferenceError("nothing was measured; give a curve, or a dictionary of curves and numbers")
    for name in measured:
        if name not in ensemble.outputs:
            raise InferenceError(f"the ensemble has no {name!r}; it has {', '.join(ensemble.outputs)}")
    if isinstance(noise, Mapping):
        if noise.keys() != measured.keys():
            raise InferenceError(f"noise names {', '.join(noise) or 'nothing'}, measured are {', '.join(measured)}; give the noise of each")
    elif len(measured) > 1:
        raise InferenceError(f"the noise of {len(measured)} measurements is {noise!r}; give a dictionary with the noise of each")
    else:
        noise = dict.fromkeys(measured, noise)
    if not (np.isfinite(correlation_length) and correlation_length >= 0):
        raise InferenceError(f"correlation_length is {correlation_length}; give 0 or a length along the abscissa in SI units")
    data = [_datum(ensemble.outputs[name], given, noise[name], correlation_length) for name, given in measured.items()]
    estimated = [datum.output.name for datum in data if datum.estimated]
    if len(estimated) > 1:
        raise InferenceError(f"the noise of {' and '.join(estimated)} is to be estimated; give the noise of all but one")
    return data


def _datum(output: Output, given: Any, noise: Any, correlation_length: float) -> _Datum:
    name = output.name
    curve = None
    if output.x is None:
        value, unit = quantity(given, f"the measured {name!r}")
        _same_unit(f"the measured {name!r}", unit, output.unit)
        values, to_measured, x = np.array([value]), np.ones((1, 1)), np.zeros(1)
    else:
        curve = curve_of(given, name)
        _same_unit(f"the ordinate of the measured curve {name!r}", curve.y_unit, output.unit)
        _same_unit(f"the abscissa of the measured curve {name!r}", curve.x_unit, output.x_unit)
        x, values = curve.x, curve.y
        low, high = output.x[0], output.x[-1]
        slack = 1e-9 * (high - low)
        if x.min() < low - slack or x.max() > high + slack:
            turned = -x.max() >= low - slack and -x.min() <= high + slack
            remedy = "turn the signs of x and y: compression is negative" if turned else f"cut it with curve.within({low:g}, {high:g}), or let the runs go further"
            raise InferenceError(f"the measured curve {name!r} reaches from {x.min():g} to {x.max():g}, the ensemble from {low:g} to {high:g}; {remedy}")
        if len(x) > _MOST_POINTS:
            raise InferenceError(f"the measured curve {name!r} has {len(x)} points, more than {_MOST_POINTS}; take curve.thinned(200)")
        # Linear interpolation as a matrix.
        at = np.clip(np.searchsorted(output.x, x, side="right") - 1, 0, len(output.x) - 2)
        share = (x - output.x[at]) / (output.x[at + 1] - output.x[at])
        to_measured = np.zeros((len(x), len(output.x)))
        to_measured[np.arange(len(x)), at], to_measured[np.arange(len(x)), at + 1] = 1 - share, share
    count = len(values)
    near = np.eye(count)
    if correlation_length > 0 and output.x is not None:
        near = np.exp(-np.abs(x[:, None] - x) / correlation_length)
    if isinstance(noise, str) and noise == "estimate":
        if output.x is None or count < 5:
            raise InferenceError(f"the noise of {name!r} cannot be estimated from {count} values; give its standard deviation")
        return _Datum(output, curve, values, to_measured, near, True)
    if isinstance(noise, str) or np.ndim(noise) == 0:
        size, unit = quantity(noise, f"the noise of {name!r}")
        _same_unit(f"the noise of {name!r}", unit, output.unit)
        covariance = size**2 * near
        wrong = not size > 0
    else:
        array = np.asarray(noise, np.float64)
        wrong = not np.isfinite(array).all()
        if array.shape == (count,):
            covariance = array[:, None] * near * array
            wrong = wrong or not (array > 0).all()
        elif array.shape == (count, count):
            if correlation_length > 0:
                raise InferenceError(f"the noise of {name!r} is a covariance matrix, which has the correlations; leave out correlation_length")
            covariance = array
            wrong = wrong or not np.allclose(array, array.T) or np.linalg.eigvalsh(array)[0] <= 0
        else:
            raise InferenceError(f"the noise of {name!r} has the shape {array.shape}; give one number, ({count},), or ({count}, {count})")
    if wrong:
        raise InferenceError(f"the noise of {name!r} is not positive; give standard deviations above 0, or a positive definite covariance matrix")
    return _Datum(output, curve, values, to_measured, covariance, False)


def _same_unit(what: str, given: str | None, expected: str) -> None:
    """Refuse units that differ; those that are not known fit all."""
    if given is not None and expected and unit_of(given)[0] != unit_of(expected)[0]:
        raise InferenceError(f"{what} is in {given}, the ensemble in {expected}; convert it, or choose another column")


def _densities(ensemble: Ensemble, priors: Mapping[str, Any]) -> list[Callable[[Reals], Reals] | None]:
    """Logarithms of prior densities on the unit range, but for a constant; None where uniform."""
    for name, distribution in priors.items():
        if name not in ensemble.names:
            raise InferenceError(f"there is a prior of {name!r}; the parameters are {', '.join(ensemble.names)}")
        if not (hasattr(distribution, "logpdf") and hasattr(distribution, "cdf")):
            raise InferenceError(f"the prior of {name!r} is a {type(distribution).__name__}; give a distribution, such as scipy.stats.norm(30e9, 2e9)")
    found: list[Callable[[Reals], Reals] | None] = []
    for one in ensemble.parameters:
        distribution = priors.get(one.name)
        if distribution is None:
            found.append(None)
            continue
        inside = float(distribution.cdf(one.high) - distribution.cdf(one.low))
        if inside < 0.5:
            raise InferenceError(f"{inside:.0%} of the prior of {one.name!r} lie in its range {one.low:g} to {one.high:g}; run the ensemble where the prior is")

        def density(fractions: Reals, one: Any = one, distribution: Any = distribution) -> Reals:
            values = one.from_unit(fractions)
            # Densities per value become densities per fraction of the range.
            jacobian = np.log(values) if one.scale == "logarithmic" else 0.0
            return np.asarray(distribution.logpdf(values) + jacobian, np.float64)

        found.append(density)
    return found


class _Point(NamedTuple):
    """What the likelihood needs at p points with q components."""

    mean: Reals
    #: Of each measured value, (p, measured); None where the noise is given.
    weight: Reals | None
    gram: Reals
    #: Square root of the components' covariance, transposed, (p, q, q).
    across: Reals
    lower: Reals


class _Likelihood:
    """Logarithm of the likelihood at points of the unit cube; the last column is the noise where it is estimated."""

    def __init__(self, emulator: Emulator, data: list[_Datum], specimens: int) -> None:
        self.emulator, self.data = emulator, data
        self.estimated = any(datum.estimated for datum in data)
        at, count = [], 0
        for datum in data:
            at.append(slice(count, count + len(datum.values)))
            count += len(datum.values)

        def joined(rows: Reals) -> Reals:
            """Rows of the outputs at the measured points."""
            return np.concatenate([rows[:, emulator.places[datum.output.name]] @ datum.to_measured.T for datum in data], 1)

        measured = np.concatenate([datum.values for datum in data])
        truncation, scatter = joined(emulator.truncation), joined(emulator.scatter) * np.sqrt(1 / specimens + emulator.share_of_mean)
        fixed = truncation.T @ truncation + scatter.T @ scatter
        free = np.zeros((count, count))
        self.largest = 1.0
        for datum, place in zip(data, at):
            if datum.estimated:
                self.largest = float(np.ptp(datum.values)) or float(np.abs(datum.values).max()) or 1.0
                free[place, place] = datum.noise
            else:
                fixed[place, place] += datum.noise
        self.rank = sum(len(datum.values) for datum in data if datum.estimated)
        self.reference = 0.03 * self.largest
        self.least = 1e-4 * self.largest
        base = fixed + self.reference**2 * free if self.estimated else fixed
        # Rounding must not make it indefinite.
        base[np.diag_indices(count)] *= 1 + 1e-10
        lower = np.linalg.cholesky(base)
        residual = measured - joined(emulator.center[None])[0]
        residual, basis = np.linalg.solve(lower, residual), np.linalg.solve(lower, joined(emulator.basis).T)
        if self.estimated:
            half = np.linalg.solve(lower, free)
            self.eigenvalues, vectors = np.linalg.eigh(np.linalg.solve(lower, half.T))
            residual, basis = vectors.T @ residual, vectors.T @ basis
        self.residual, self.basis, self.fixed, self.joined = residual, basis, fixed, joined
        self.constant = 2 * float(np.log(np.diag(lower)).sum())
        self.white = emulator.white / (1 if emulator.repeated else specimens)
        q = basis.shape[1]
        self.gram, self.along, self.square = basis.T @ basis, basis.T @ residual, float(residual @ residual)
        self.products = (basis[:, :, None] * basis[:, None, :]).reshape(count, q * q)
        self.shifts = basis * residual[:, None]

    def noise_at(self, fraction: Reals) -> Reals:
        """The noise: uniform in its logarithm, from 1e-4 of the range of the measured values to all of it."""
        found: Reals = self.least * (self.largest / self.least) ** fraction
        return found

    def _at(self, points: Reals) -> _Point:
        """Means of the components, and what whitening by noise, scatter, and error of the emulator needs."""
        d = self.emulator.train.shape[1]
        mean, variance = self.emulator.components(points[:, :d])
        q = mean.shape[1]
        weight = None
        gram = np.broadcast_to(self.gram, (len(points), q, q))
        if self.estimated:
            change = 1 + (self.noise_at(points[:, d]) ** 2 - self.reference**2)[:, None] * self.eigenvalues
            weight = 1 / np.maximum(change, 1e-12)
            gram = (weight @ self.products).reshape(-1, q, q)
        # Woodbury: the components' variance is a low rank above noise and scatter.
        root = np.sqrt(variance + self.white)[:, :, None] * self.emulator.mixing
        across = root.transpose(0, 2, 1)
        return _Point(mean, weight, gram, across, np.linalg.cholesky(np.eye(q) + across @ gram @ root))

    def _parts(self, points: Reals) -> tuple[Reals, Reals]:
        """Squared distance of the measurement in deviations, and the logarithm of the determinant of the covariance."""
        mean, weight, gram, across, lower = self._at(points)
        if weight is None:
            along, square, determinant = self.along, self.square, np.zeros(len(points))
        else:
            along, square, determinant = weight @ self.shifts, weight @ self.residual**2, -np.log(weight).sum(1)
        moved = (gram @ mean[:, :, None])[:, :, 0]
        distance = square - 2 * (along * mean).sum(1) + (mean * moved).sum(1)
        toward = along - moved
        solved = np.linalg.solve(lower, across @ toward[:, :, None])[:, :, 0]
        determinant = determinant + 2 * np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(1)
        return distance - (solved**2).sum(1), determinant + self.constant

    def information(self, points: Reals) -> Reals:
        """Fisher information of the means about the parameters on the unit range, (p, d, d)."""
        d = self.emulator.train.shape[1]
        _, _, gram, across, lower = self._at(points)
        solved = np.linalg.solve(lower, across @ gram)
        inverse = gram - solved.transpose(0, 2, 1) @ solved
        slopes = np.empty((len(points), gram.shape[1], d))
        for k in range(d):
            ends = [np.clip(points[:, :d] + step * np.eye(d)[k], 0.0, 1.0) for step in (_STEP, -_STEP)]
            up, down = (self.emulator.components(end)[0] for end in ends)
            slopes[:, :, k] = (up - down) / (ends[0] - ends[1])[:, k, None]
        found: Reals = slopes.transpose(0, 2, 1) @ inverse @ slopes
        return found

    def __call__(self, points: Reals) -> Reals:
        distance, determinant = self._parts(points)
        return -0.5 * (distance + determinant)

    def misfit(self, point: Reals) -> float:
        """Probability of so large a distance at the best point (chi squared)."""
        from scipy.stats import chi2

        distance = float(self._parts(point[None])[0][0])
        freedom = max(len(self.residual) - self.emulator.train.shape[1], 1)
        return float(chi2.sf(distance, freedom))

    def emulator_errors(self, noise: float) -> dict[str, float]:
        """Error of the emulator at runs left out, over noise and scatter, by output."""
        errors = self.joined(self.emulator.left_out)
        truncation = self.joined(self.emulator.truncation)
        variance = np.diag(self.fixed) - (truncation**2).sum(0)
        found, begin = {}, 0
        for datum in self.data:
            place = slice(begin, begin + len(datum.values))
            begin = place.stop
            own = variance[place].mean() + (noise**2 if datum.estimated else 0.0)
            found[datum.output.name] = float(np.sqrt((errors[:, place] ** 2).mean() / max(own, 1e-300)))
        return found


def _sample(log_probability: Callable[[Reals], Reals], d: int, seed: int, draws: int) -> tuple[Reals, float]:
    """Samples in the unit cube, (k, d), and the number of effective ones."""
    emcee = needed("emcee")
    from scipy.stats import qmc

    walkers = max(64, 8 * d)
    random = np.random.default_rng(seed)
    start = qmc.Sobol(d, scramble=True, rng=random).random(1024)
    values = log_probability(start)
    if not np.isfinite(values).any():
        raise InferenceError("no parameters in the ranges have a finite likelihood; check units and noise of the measured values")
    # Temper the likelihood until twice as many points as walkers share the weight; the walkers start there.
    power = 1.0
    while True:
        weight = np.exp(power * (values - values.max()))
        if weight.sum() ** 2 / (weight**2).sum() >= 2 * walkers or power < 1e-6:
            break
        power *= 0.7
    chosen = start[random.choice(len(start), walkers, replace=False, p=weight / weight.sum() * (1 - 1e-9) + 1e-9 / len(weight))]
    # Differences of walkers (ter Braak 2006) forget faster than stretches here: in 10 steps instead of 27.
    moves = [(emcee.moves.DEMove(), 0.8), (emcee.moves.StretchMove(), 0.2)]
    sampler = emcee.EnsembleSampler(walkers, d, log_probability, moves=moves, vectorize=True)
    state = emcee.State(chosen, random_state=np.random.RandomState(seed).get_state())
    state = sampler.run_mcmc(state, 100, skip_initial_state_check=True)
    sampler.reset()
    steps, effective = 0, 0.0
    while steps < 4000:
        state = sampler.run_mcmc(state, 130 + steps // 2, skip_initial_state_check=True)
        steps = sampler.iteration
        # A walker that has not moved yet has no correlation.
        with np.errstate(invalid="ignore"):
            time = float(np.max(emcee.autocorr.integrated_time(sampler.get_chain(), tol=0, quiet=True)))
        if not np.isfinite(time):
            continue
        effective = walkers * steps / max(time, 1.0)
        if effective >= draws and steps > 12 * time:
            break
    thin = max(1, steps * walkers // (8 * draws))
    chain: Reals = sampler.get_chain(flat=True, thin=thin)
    return chain, effective
