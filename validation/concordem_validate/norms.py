"""Norms of the difference of two curves: one number each, as a part of a scale."""
import numpy as np

from .errors import Incomparable


def width(values):
    return 3 if values.ndim >= 2 and values.shape[-1] == 3 else 1


def sizes(values):
    """Norms of vectors or absolute values, one per point and particle."""
    return np.linalg.norm(values.reshape(len(values), -1, width(values)), axis=2)


def _curve(values):
    """One curve: a number at each point, the largest of the particles where there are several."""
    flat = values.reshape(len(values), -1)
    return flat[:, 0] if flat.shape[1] == 1 else sizes(values).max(axis=1)


def _largest(x, a, b, scale):
    return float(sizes(a - b).max()) / scale


def _l2(x, a, b, scale):
    """Root of the mean square over all points and particles."""
    return float(np.sqrt(np.mean(sizes(a - b) ** 2))) / scale


def _end(x, a, b, scale):
    return float(sizes(a[-1:] - b[-1:]).max()) / scale


def _peak(x, a, b, scale):
    """Largest and smallest values, of each particle and component: a peak of the other sign, or of another particle, is another peak."""
    ends = lambda values: np.array([(flat := values.reshape(len(values), -1)).max(axis=0), flat.min(axis=0)])
    return float(np.abs(ends(a) - ends(b)).max()) / scale


def _place(x, a, b, scale):
    """Distance of the places of the peaks, as a part of the whole axis."""
    at = lambda values: x[int(np.argmax(np.abs(_curve(values))))]
    return abs(float(at(a) - at(b))) / float(np.ptp(x))


def _area(x, a, b, scale):
    """Difference of the areas under the curves over the area under the size of the reference."""
    under = lambda y: float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)))
    whole = abs(under(np.abs(_curve(b))))
    if not whole > 0:
        raise Incomparable("error", "the area under the reference is zero; use another norm")
    return abs(under(_curve(a)) - under(_curve(b))) / whole


def _arrival(x, a, b, scale):
    """Distance of the first points where the curves have changed by half of their largest change, as a part of the whole axis."""
    def at(values):
        change = np.abs(_curve(values) - _curve(values)[0])
        half = 0.5 * change.max()
        k = int(np.argmax(change >= half))
        if k == 0:
            return x[0]
        return x[k - 1] + (x[k] - x[k - 1]) * (half - change[k - 1]) / (change[k] - change[k - 1])
    return abs(float(at(a) - at(b))) / float(np.ptp(x))


def _spectrum(x, a, b, scale):
    """Largest difference of the amplitudes of their frequencies over the largest amplitude of the reference."""
    gaps = np.diff(x)
    if np.ptp(gaps) > 1e-6 * np.abs(gaps).max():
        raise Incomparable("error", "a spectrum needs points at equal distances; set a window, or write at equal intervals")
    change = lambda y: np.abs(np.fft.rfft(y.reshape(len(y), -1) - y.reshape(len(y), -1).mean(axis=0), axis=0))
    reference = change(b)
    if not reference.max() > 0:
        raise Incomparable("error", "the reference has no spectrum: it is constant")
    return float(np.abs(change(a) - reference).max() / reference.max())


NORMS = {"max": _largest, "l2": _l2, "end": _end, "peak": _peak, "peak-place": _place, "area": _area, "arrival": _arrival,
         "spectrum": _spectrum}
