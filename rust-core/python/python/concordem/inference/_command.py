"""The command ``python -m concordem posterior``."""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

from .._errors import ConcordemError, ConcordemWarning, InferenceError
from ._ensemble import Ensemble
from ._optional import needed
from ._posterior import posterior
from ._quantities import Curve


def main(arguments: Sequence[str]) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(
        "concordem posterior",
        description="Compare a sampled sweep with a measured curve; write the distribution of each parameter (-o), the curve in its predictive band "
        "(NAME-curve.png), and figures (NAME.json).",
    )
    parser.add_argument("ensemble", type=Path, help="result of a sampled sweep (.h5), or an ensemble that Python has saved (.npz)")
    parser.add_argument("curve", type=Path, help="CSV file with units in its header, such as: strain [%%],stress [MPa]")
    parser.add_argument("-o", "--output", type=Path, default=Path("posterior.png"), help="picture, .png, .svg, or .pdf; posterior.png by default")
    parser.add_argument("--name", help="output of the ensemble that was measured; needed if it has several curves")
    parser.add_argument("--noise", default="estimate", help="standard deviation of the measured values, such as '0.1 MPa'; estimated by default")
    parser.add_argument("--correlation-length", type=float, default=0.0, help="of the noise along the abscissa, SI unit; 0 by default")
    parser.add_argument("-x", help="column of the abscissa; needed if the file has more than two columns")
    parser.add_argument("-y", help="column of the ordinate")
    parser.add_argument("--specimens", type=int, default=1, help="number of specimens of which the curve is the mean")
    parser.add_argument("--seed", type=int, default=1, help="of the sampler; equal seeds give equal figures")
    parser.add_argument("--force", action="store_true", help="replace files")
    options = parser.parse_args(arguments)
    output: Path = options.output
    files = [output, output.with_name(f"{output.stem}-curve{output.suffix}"), output.with_suffix(".json")]
    try:
        if output.suffix not in (".png", ".svg", ".pdf"):
            raise InferenceError(f"the picture {output} is neither .png, .svg, nor .pdf; choose another name")
        for file in files:
            if file.exists() and not options.force:
                raise InferenceError(f"{file} exists; choose another name by --output, or replace it with --force")
        needed("matplotlib").use("Agg")
        from matplotlib import pyplot

        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always", ConcordemWarning)
            ensemble = Ensemble.load(options.ensemble) if options.ensemble.suffix == ".npz" else Ensemble.from_sweep(options.ensemble)
        for one in told:
            # Without the line of this file.
            print(f"warning: {one.message}", file=sys.stderr)
        curves = [name for name, one in ensemble.outputs.items() if one.x is not None]
        name = options.name or (curves[0] if len(curves) == 1 else None)
        if name is None:
            raise InferenceError(f"the ensemble has the curves {', '.join(curves) or '(none)'}; choose one by --name")
        with warnings.catch_warnings():
            # The summary has them.
            warnings.simplefilter("ignore", ConcordemWarning)
            found = posterior(
                ensemble,
                {name: Curve.from_csv(options.curve, options.x, options.y)},
                noise=options.noise,
                correlation_length=options.correlation_length,
                specimens=options.specimens,
                seed=options.seed,
            )
        print(found.summary())
        found.plot().savefig(files[0], dpi=150)
        figure, axes = pyplot.subplots(layout="constrained")
        found.plot_predictive(name, axes)
        figure.savefig(files[1], dpi=150)
        files[2].write_text(json.dumps(found.to_dict(), indent=1) + "\n", encoding="utf-8")
    except (ConcordemError, OSError, ImportError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    for file in files:
        print(file)
    return 0
