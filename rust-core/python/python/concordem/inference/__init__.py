"""From a measured curve to the parameters of a law, with their uncertainty.

An :class:`Ensemble` has runs at many values of the parameters and what they gave. :func:`posterior` compares it with a measured
:class:`Curve` and gives a :class:`Posterior`: how plausible each value is (Kennedy and O'Hagan 2001; Higdon et al. 2008).

>>> import numpy as np
>>> from concordem.inference import Curve, Ensemble, posterior
>>> x = np.linspace(0.0, 1.0, 21)
>>> ensemble = Ensemble.from_model(lambda values: values["a"] * x + values["b"], {"a": (0, 4), "b": (-1, 1)}, count=32, x=x)
>>> noise = np.random.default_rng(1).normal(0, 0.05, len(x))
>>> found = posterior(ensemble, Curve(x, 2.0 * x + 0.5 + noise), noise=0.05)  # doctest: +SKIP
>>> print(found.summary())  # doctest: +SKIP

The optional packages are scikit-learn (the emulator), emcee (the sampler), SciPy, and h5py (sweep files):
``python -m pip install 'concordem[inference]'``. Both were chosen by trying: scikit-learn's Gaussian processes and emcee's ensemble sampler run with NumPy 2
and have few dependencies. The sequential filter of GrainLearning 2.0 needs NumPy 1 and gives weights of the runs themselves, without the
error of an emulator; the tutorial "From a curve to a posterior" shows how to use it.
"""

from ._ensemble import Ensemble, Parameter
from ._posterior import Posterior, posterior
from ._quantities import Curve

__all__ = ["Curve", "Ensemble", "Parameter", "Posterior", "posterior"]
