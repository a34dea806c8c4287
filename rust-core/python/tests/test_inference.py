"""From measured curves to posteriors: known parameters are recovered with the promised frequency, and what cannot be known is said."""

import doctest
import json
import subprocess
import sys
import warnings
from pathlib import Path

import concordem
import numpy as np
import pytest
from concordem import datasets, inference
from concordem.inference import Curve, Ensemble, Parameter, posterior
from concordem.inference._pictures import _scale
from concordem.inference._quantities import unit_of

# scikit-learn and emcee are in the first interpreter of test.sh, where a missing one is a failure.
pytestmark = pytest.mark.once

DATA = Path(__file__).parent / "data"
X = np.linspace(0.0, 1e-3, 28)
SOFTENING = {"young": ("20 GPa", "40 GPa"), "strength": ("2 MPa", "5 MPa"), "energy": ("60 N/m", "150 N/m", "logarithmic")}


def softening(values):
    """Stress of a bar of 0.1 m: linear to the strength, then exponential softening with the given energy per area."""
    onset = values["strength"] / values["young"]
    decay = values["energy"] / (values["strength"] * 0.1) - onset / 2
    return np.where(X < onset, values["young"] * X, values["strength"] * np.exp(-(X - onset) / decay))


@pytest.fixture(scope="module")
def soft():
    return Ensemble.from_model(softening, SOFTENING, count=48, x=X, name="stress")


def test_documentation_examples():
    from concordem.inference import _ensemble, _posterior, _quantities

    outcomes = [doctest.testmod(module) for module in (inference, _ensemble, _posterior, _quantities, datasets)]
    assert not any(outcome.failed for outcome in outcomes) and sum(outcome.attempted for outcome in outcomes) > 20


def quiet(*arguments, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", concordem.ConcordemWarning)
        return posterior(*arguments, **options)


def held(found, values, probability=0.9):
    """Which of the true values lie in their intervals."""
    return [low <= values[name] <= high for name, (low, high) in found.interval(probability).items()]


def inner_points(ensemble, count, seed):
    """Values in the inner four fifths of the ranges."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        yield {one.name: float(one.from_unit(random.uniform(0.1, 0.9))) for one in ensemble.parameters}, random


def test_intervals_of_a_closed_form_hold_the_truth_as_often_as_they_say(soft):
    hits = []
    for trial, (truth, random) in enumerate(inner_points(soft, 50, 0)):
        measured = softening(truth) + random.normal(0, 1e5, len(X))
        hits.append(held(quiet(soft, (X, measured), noise="0.1 MPa", seed=trial, draws=200), truth))
    share = np.mean(hits, axis=0)
    # Of 50 intervals of 90 %, fewer than 40 hold the truth once in a hundred times.
    assert (share >= 0.8).all() and np.mean(hits) < 0.99, share


def test_noise_is_estimated(soft):
    truth = {"young": 30e9, "strength": 3e6, "energy": 90.0}
    measured = softening(truth) + np.random.default_rng(3).normal(0, 1e5, len(X))
    found = quiet(soft, Curve(X, measured, y_unit="Pa"))
    noise = found.samples["noise"]
    # 28 points give the deviation to some 13 %; four times that, and the emulator's own error.
    assert 0.6e5 < noise.mean() < 1.5e5
    assert all(held(found, truth, 0.99))
    assert "noise" in found.summary() and found.misfit is None
    assert found.interval(0.5)["young"][0] > found.interval(0.9)["young"][0]


def test_intervals_that_neglect_noise_fail(soft):
    # The check above can fail: with a third of the noise, intervals are too narrow, and a warning names the misfit.
    hits = []
    for trial, (truth, random) in enumerate(inner_points(soft, 5, 1)):
        measured = softening(truth) + random.normal(0, 3e5, len(X))
        found = quiet(soft, (X, measured), noise=1e5, seed=trial, draws=200)
        assert any("within the noise" in text for text in found.warnings)
        hits.append(held(found, truth))
    assert np.mean(hits) < 0.8


def test_linear_model_has_the_posterior_of_the_closed_form():
    """y = a x + b, Gaussian noise: mean and covariance are those of linear least squares (Gelman et al. 2013, section 14.2)."""
    x = np.linspace(0.0, 1.0, 15)
    ensemble = Ensemble.from_model(lambda v: v["a"] * x + v["b"], {"a": (-4.0, 6.0), "b": (-5.0, 5.0)}, count=32, x=x)
    measured = 0.2 * x + 1.0 + np.random.default_rng(0).normal(0, 0.3, 15)
    found = posterior(ensemble, (x, measured), noise=0.3, draws=4000)
    design = np.stack([x, np.ones(15)], 1)
    covariance = np.linalg.inv(design.T @ design) * 0.3**2
    mean = covariance @ design.T @ measured / 0.3**2
    deviations = np.sqrt(np.diag(covariance))
    # 4,000 effective samples: means to 1/63 of a deviation, deviations to 1.1 %; three times that.
    assert np.abs(np.array(list(found.means.values())) - mean).max() < 0.05 * deviations.max()
    assert np.array(list(found.standard_deviations.values())) == pytest.approx(deviations, rel=0.04)
    assert found.correlation[0, 1] == pytest.approx(covariance[0, 1] / deviations.prod(), abs=0.02)


def test_elastic_constants_of_cells():
    """E and ν of unknown packings, by an ensemble of others."""
    scenario = concordem.Scenario.template("cpm-periodic").with_settings({"packing.count": 60})

    def constants(young, ratio, seed):
        settings = {"material[0].cpm.young": young, "material[0].cpm.shear_ratio": ratio, "packing.seed": seed}
        static = concordem.elastic_constants(scenario.with_settings(settings), threads=1).static
        return static.young, static.poisson

    ranges = [Parameter("young", 15e9, 30e9, unit="Pa"), Parameter("shear_ratio", 0.1, 0.5, unit="1")]
    random = np.random.default_rng(4)
    points = [[ranges[0].from_unit(a), ranges[1].from_unit(b)] for a, b in (random.permutation(10)[:, None] + [0.5, 0]) / 10 for b in [random.random()]]
    points = [row for row in points for _ in range(4)]
    found = np.array([constants(*row, 1 + k % 4) for k, row in enumerate(points)])
    ensemble = Ensemble.from_arrays(ranges, points, scalars={"E": found[:, 0], "nu": found[:, 1]}, units={"E": "Pa", "nu": "1"})
    hits = []
    for trial, (truth, random) in enumerate(inner_points(ensemble, 15, 2)):
        young, poisson = constants(truth["young"], truth["shear_ratio"], 11 + trial)
        measured = {"E": young * (1 + 0.01 * random.normal()), "nu": poisson + 0.005 * random.normal()}
        hits.append(held(quiet(ensemble, measured, noise={"E": 0.01 * young, "nu": 0.005}, draws=200, seed=trial), truth))
    # 30 intervals of 90 % that are nearly independent.
    assert np.mean(hits) >= 0.8, np.mean(hits, axis=0)


@pytest.fixture(scope="module")
def bars():
    """40 small bars of concrete in tension, with four packings each; made by the scenario and ranges of `test_bars_are_those_of_the_solver`."""
    return Ensemble.load(DATA / "bars.npz")


def test_bars_are_those_of_the_solver(bars):
    scenario = concordem.Scenario.template("cpm-small").with_settings({
        "packing.count": 100, "packing.shape.size": ["7 mm", "7 mm", "14 mm"], "loading.strain_rate": "1.5 1/s", "output.sample_interval": 20,
        "stop.strain": 1.2e-3, "stop.drop_to": 0.001})  # fmt: skip
    stress = bars.outputs["stress"]
    names = [f"material[0].cpm.{name}" for name in bars.names]
    rows = []
    for packing in (1, 2, 3, 4):
        simulation = scenario.with_settings({**dict(zip(names, map(float, bars.inputs[0]))), "packing.seed": packing}).simulation(threads=1)
        simulation.run()
        samples = simulation.samples
        rows.append(np.interp(stress.x, samples["strain"], samples["stress"]))
    # Strains fall back by a part of the distance of two points only while bonds break.
    assert np.mean(rows, axis=0) == pytest.approx(stress.mean[0], rel=0.05, abs=2e4)


def test_softening_of_bars_with_unknown_packings(bars):
    others = np.load(DATA / "other_bars.npz")
    random = np.random.default_rng(6)
    hits = []
    for trial, (values, stress) in enumerate(zip(others["values"][:16], others["stress"])):
        measured = stress + random.normal(0, 5e4, len(stress))
        found = quiet(bars, Curve(others["x"], measured, x_unit="1", y_unit="Pa"), noise="0.05 MPa", seed=trial, draws=200)
        hits.append(held(found, dict(zip(bars.names, values))))
    # 48 intervals of 90 %, of which three share a curve.
    assert np.mean(hits) >= 0.8, np.mean(hits, axis=0)
    # Without the scatter of the packings they are too narrow.
    stress = bars.outputs["stress"]
    alone = Ensemble.from_arrays(bars.parameters, bars.inputs, curves={"stress": (stress.x, stress.mean)})
    narrow = [held(quiet(alone, (others["x"], stress), noise="0.05 MPa", draws=200), dict(zip(bars.names, values)))
              for values, stress in zip(others["values"][:5], others["stress"])]  # fmt: skip
    assert np.mean(narrow) < 0.7


def test_a_pair_that_only_acts_together_is_told():
    x = np.linspace(0.0, 1.0, 11)
    priors = {"a": (1.0, 4.0), "b": (1.0, 4.0), "c": (-1.0, 1.0), "idle": (0.0, 1.0)}
    ensemble = Ensemble.from_model(lambda v: v["a"] * v["b"] * x + v["c"], priors, count=64, x=x)
    with pytest.warns(concordem.ConcordemWarning) as caught:
        found = posterior(ensemble, (x, 5.0 * x), noise=0.1)
    assert len(caught) == len(found.warnings) == 2
    assert "'a' and 'b' are not told apart" in found.warnings[0] and "'idle' is not determined" in found.warnings[1]
    product = found.samples["a"] * found.samples["b"]
    assert product.std() < 0.03 * product.mean() and abs(product.mean() - 5.0) < 0.2


def test_groups_that_only_act_together_are_told():
    """Of a b c only the product matters, of d - e and e - f the differences, g alone."""
    x = np.linspace(0.0, 1.0, 12)
    priors = dict.fromkeys("abc", (1.0, 4.0)) | dict.fromkeys("defg", (0.0, 1.0))
    bases = np.repeat(np.eye(4), 3, axis=1)

    def model(v):
        parts = v["a"] * v["b"] * v["c"], 8 * (v["d"] - v["e"]), 8 * (v["e"] - v["f"]), 8 * v["g"]
        return sum(part * base for part, base in zip(parts, bases))

    ensemble = Ensemble.from_model(model, priors, count=128, x=x)
    found = quiet(ensemble, (x, model(dict.fromkeys("abc", 2.0) | dict.fromkeys("defg", 0.5))), noise=0.4, draws=200)
    told = [text.partition(";")[0] for text in found.warnings if "told apart" in text]
    assert told == ["'a', 'b', and 'c' are not told apart, only a combination of them is determined",
                    "'d', 'e', and 'f' are not told apart, only combinations of them are determined"]  # fmt: skip
    assert "fix two of them" in found.warnings[0] and "fix one of them" in found.warnings[1]
    assert not any("'g'" in text for text in found.warnings)


def test_a_posterior_at_the_end_of_a_range_is_told():
    x = np.linspace(0.0, 1.0, 11)
    ensemble = Ensemble.from_model(lambda v: v["a"] * x, {"a": (1.0, 2.0)}, count=16, x=x)
    with pytest.warns(concordem.ConcordemWarning, match="'a' lies at the upper end of its range, 2"):
        posterior(ensemble, (x, 2.0 * x), noise=0.05)
    assert "no parameters in the ranges" in quiet(ensemble, (x, 3.0 * x), noise=0.05).warnings[-1]


def test_too_few_runs_are_told():
    ensemble = Ensemble.from_model(lambda v: np.sin(25 * v["a"]) * (1 + X), {"a": (0.0, 1.0)}, count=8, x=X)
    assert any("add runs" in text for text in quiet(ensemble, (X, 0.3 * (1 + X)), noise=0.01).warnings)


def test_priors_and_several_measurements():
    from scipy import stats

    ensemble = Ensemble.from_model(lambda v: {"sum": v["a"] + v["b"], "a": v["a"]}, {"a": (0.0, 2.0), "b": (0.1, 10.0, "logarithmic")}, count=40)
    found = posterior(ensemble, {"sum": 3.0, "a": "1"}, noise={"sum": 0.1, "a": 0.2}, draws=2000)
    # Two Gaussian measurements: a = 1 ± 0.2, b = 2 ± (0.1² + 0.2²)^½, slightly lower by the density 1/b.
    assert found.means["a"] == pytest.approx(1.0, abs=0.05) and found.standard_deviations["a"] == pytest.approx(0.2, rel=0.1)
    assert found.standard_deviations["b"] == pytest.approx(0.224, rel=0.1)
    sure = quiet(ensemble, {"sum": 3.0}, noise=0.1, priors={"a": stats.norm(0.5, 0.05)}, draws=1000)
    assert sure.means["a"] == pytest.approx(0.5, abs=0.02) and sure.means["b"] == pytest.approx(2.5, abs=0.03)
    # A density per value on a logarithmic range.
    flat = quiet(ensemble, {"a": 1.0}, noise=0.2, priors={"b": stats.uniform(0.1, 9.9)}, draws=1000)
    assert flat.means["b"] == pytest.approx(5.05, rel=0.1)
    for mean in (np.mean, np.median):
        assert np.isfinite(mean(flat.predictive("a")[2]))


def test_equal_seeds_give_equal_numbers(soft):
    measured = softening({"young": 30e9, "strength": 3e6, "energy": 90.0})
    first, again, other = (quiet(soft, (X, measured), noise=1e5, draws=200, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(first.samples, again.samples) and not np.array_equal(first.samples, other.samples)
    assert first.to_pandas().shape == (len(first.samples), 3)
    json.dumps(first.to_dict())
    assert first._repr_html_().count("<tr>") == 4
    # Deviations over correlated points are larger.
    slow = quiet(soft, (X, measured), noise=1e5, draws=200, correlation_length=2e-4)
    assert slow.standard_deviations["energy"] > 1.5 * first.standard_deviations["energy"]
    matrix = 1e10 * np.exp(-np.abs(X[:, None] - X) / 2e-4)
    assert np.array_equal(quiet(soft, (X, measured), noise=matrix, draws=200).samples["young"], slow.samples["young"])


def test_runs_of_a_scenario_in_threads(tmp_path, two):
    # Two bonded spheres, of which one moves.
    scenario = two.with_settings({"stop.steps": 60, "output": {"sample_interval": 5}, "material[0].linear_bond.normal_strength": "1e6 N"})
    priors = {"material[0].linear_bond.normal_stiffness": ("1e6 N/m", "2e6 N/m"), "material[0].density": (2000, 3000)}
    options = {"count": 9, "curve": ("time", "kinetic"), "x": np.linspace(0, 1e-6, 5), "numbers": {"steps": lambda run: run.state.step}}
    once, twice = (Ensemble.run(scenario, priors, jobs=jobs, **options) for jobs in (1, 3))
    assert once.names == ("normal_stiffness", "density") and list(once.outputs) == ["kinetic", "steps"]
    assert once.parameters[0].unit == "N/m" and once.outputs["kinetic"].unit == "J" and once.outputs["kinetic"].x_unit == "s"
    kept = Ensemble.load(once.save(tmp_path / "runs.npz"))
    for other in (twice, kept):
        assert np.array_equal(once.inputs, other.inputs) and other.parameters == once.parameters
        for name, output in once.outputs.items():
            assert np.array_equal(output.mean, other.outputs[name].mean) and output.unit == other.outputs[name].unit
    with pytest.raises(concordem.InferenceError, match="x reaches 1, but a run ends at"):
        Ensemble.run(scenario, priors, **{**options, "x": [0.0, 1.0]})
    with pytest.raises(concordem.ScenarioError, match="unknown|no such|not"):
        Ensemble.run(scenario, {"material[0].linear_bond.stiffnes": (1, 2)}, count=9)


@pytest.fixture
def sweep(tmp_path):
    """A file as `concordem sweep` writes it for a sampled sweep: two sampled axes and three packings."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "ensemble.h5"
    random = np.random.default_rng(1)
    a, b, seeds = random.uniform(1, 2, 24), 10 ** random.uniform(0, 1, 24), [1, 2, 3]
    x = np.linspace(0, 1, 11)
    point, packing = np.divmod(np.arange(72), 3)
    with h5py.File(path, "w") as file:
        for k, (name, values, low, high, scale) in enumerate([("young", a, 1, 2, "linear"), ("energy", b, 1, 10, "logarithmic")]):
            axis = file.create_dataset(f"axes/{k} {name}", data=values)
            axis.attrs.update({"sampled": 1, "from": low, "to": high, "scale": scale})
            file[f"points/axis_{k}"] = point
        file["axes/2 packing.seed"] = seeds
        file["points/axis_2"] = packing
        y = a[point, None] * x - x**2 / b[point, None] + 0.01 * (packing[:, None] - 1)
        for name, values, unit in (("strain/x", x, "1"), ("strain/y", y, "MPa")):
            data = file.create_dataset(f"curves/{name.replace('strain', 'stress')}", data=values)
            data.attrs.update({"name": "n", "unit": unit})
        file.create_dataset("points/f_t", data=y.max(1)).attrs["unit"] = "Pa"
        file.create_dataset("points/f_c", data=np.full(72, np.nan)).attrs["unit"] = "Pa"
    return path


def test_result_of_a_sampled_sweep(sweep):
    ensemble = Ensemble.from_sweep(sweep)
    assert len(ensemble) == 24 and ensemble.repeats == 3 and ensemble.degrees_of_freedom == 48
    assert [(one.name, one.scale, one.high) for one in ensemble.parameters] == [("young", "linear", 2.0), ("energy", "logarithmic", 10.0)]
    assert list(ensemble.outputs) == ["stress", "f_t"]
    # Deviations of -0.01, 0, 0.01 of each point.
    assert ensemble.outputs["stress"].deviations.shape == (72, 11)
    scatter = ensemble.emulator(["stress"]).scatter
    # Student's factor of three packings.
    assert np.sqrt((scatter**2).sum(0)) == pytest.approx(0.01 * 2.91999 / 1.64485, rel=1e-4)


def test_results_of_several_sweeps(sweep, tmp_path):
    """Tension and compression of the same samples are one ensemble; other samples, and axes that are no packings, are refused."""
    h5py = pytest.importorskip("h5py")
    tension, compression = sweep.rename(tmp_path / "tension.h5"), tmp_path / "compression.h5"
    compression.write_bytes(tension.read_bytes())
    with h5py.File(compression, "r+") as file:
        file.move("curves/stress", "curves/lateral")
        file["points/f_t"][:] *= -8
        file["curves/lateral/x"][:] *= -1
    both = Ensemble.from_sweep(tension, compression)
    one = Ensemble.from_sweep(tension)
    assert list(both.outputs) == ["stress", "lateral", "tension f_t", "compression f_t"] and both.repeats == 3
    # Compression counts downwards; abscissas of an ensemble rise.
    assert np.array_equal(both.outputs["lateral"].x, -one.outputs["stress"].x[::-1])
    assert np.array_equal(both.outputs["lateral"].mean, one.outputs["stress"].mean[:, ::-1]) and both.outputs["lateral"].x_unit == "1"
    assert np.array_equal(both.outputs["compression f_t"].mean, -8 * one.outputs["f_t"].mean) and both.outputs["compression f_t"].unit == "Pa"
    axis = '[[axis]]\nkey = "{}"\nvalues = [1, 2, 3]\n{}'
    for key, more, refused in (("packing.seed", "", False), ("loading.strain_rate", "", True), ("loading.strain_rate", "average = true\n", False)):
        with h5py.File(tension, "r+") as file:
            file.pop("sweep", None)
            file["sweep"] = axis.format(key, more)
        if refused:
            with pytest.raises(concordem.InferenceError, match="values of loading.strain_rate would count as packings of one material; sample them"):
                Ensemble.from_sweep(tension)
        else:
            assert len(Ensemble.from_sweep(tension)) == 24
    with h5py.File(compression, "r+") as file:
        file["axes/0 young"][3] = 1.5
    with pytest.raises(concordem.InferenceError, match="compression.h5 has other samples than .*tension.h5; write the same axes"):
        Ensemble.from_sweep(tension, compression)
    with pytest.raises(concordem.InferenceError, match="there is no file"):
        Ensemble.from_sweep()


def test_command(sweep, tmp_path):
    x = np.linspace(0, 1, 21)
    (tmp_path / "curve.csv").write_text("strain [%],stress [MPa]\n" + "".join(f"{100 * a},{1.5 * a - a * a / 3}\n" for a in x))
    with pytest.importorskip("h5py").File(sweep, "r+") as file:
        file["points/f_t"][:3] = np.nan
    command = [sys.executable, "-m", "concordem", "posterior", "ensemble.h5", "curve.csv", "-o", "p.png", "--noise", "0.02 MPa"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-3:] == ["p.png", "p-curve.png", "p.json"]
    assert done.stderr.startswith("warning: 3 of 72 runs have no finite") and ".py" not in done.stderr, done.stderr
    found = json.loads((tmp_path / "p.json").read_text())["parameters"]
    low, high = found["young"]["interval_90"]
    assert low < 1.5 < high and found["energy"]["prior"] == [1.0, 10.0]
    again = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert again.returncode == 2 and "p.png exists" in again.stderr and "--force" in again.stderr


def test_pictures(soft):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    measured = softening({"young": 30e9, "strength": 3e6, "energy": 90.0})
    found = quiet(soft, (X, measured), noise=1e5, draws=200)
    figure = found.plot()
    assert len(figure.axes) == 9 and figure.axes[6].get_xlabel() == "young, GPa" and figure.axes[8].get_xscale() == "log"
    axes = found.plot_predictive()
    assert axes.get_ylabel() == "stress, $10^{6}$" and {"measured", "median"} <= {line.get_label() for line in axes.get_lines()}
    x, low, median, high = found.predictive(noise=False)
    # The truth is smooth: it lies in the band of specimens almost everywhere, and the median near it.
    assert np.mean((low <= measured) & (measured <= high)) > 0.8 and np.abs(median - measured).max() < 5e5
    # Ticks are short numbers in the unit of the label.
    figure.canvas.draw()
    assert [label.get_text() for label in figure.axes[6].get_xticklabels()] == ["22", "30", "38"]
    pyplot.close("all")


@pytest.mark.parametrize(
    ("largest", "unit", "size", "name"),
    [(4e10, "Pa", 1e9, "GPa"), (150.0, "N/m", 1.0, "N/m"), (2e-3, "m", 1e-3, "mm"), (2e5, "Pa m^0.5", 1e3, "kPa m^0.5"), (3e-6, "m^2", 1.0, "m^2"),
     (1.6e-4, "1", 1e-4, "$10^{-4}$"), (0.4, "", 1.0, ""), (0.0, "s", 1.0, "s")],
)  # fmt: skip
def test_scales_of_pictures(largest, unit, size, name):
    assert _scale(largest, unit) == (pytest.approx(size), name)


@pytest.mark.parametrize(
    ("text", "unit", "factor"),
    [("MPa", "Pa", 1e6), ("%", "1", 1e-2), ("N/mm^2", "Pa", 1e6), ("kN/mm", "N/m", 1e6), ("J/m²", "N/m", 1.0), ("1/s", "1/s", 1.0), ("min", "s", 60.0),
     ("mm", "m", 1e-3), ("µm", "m", 1e-6), ("MPa*m^0.5", "N/m^1.5", 1e6), ("", "1", 1.0), ("kg/m^3", "kg/m^3", 1.0)],
)  # fmt: skip
def test_units(text, unit, factor):
    assert unit_of(text) == (unit, pytest.approx(factor))


@pytest.mark.parametrize(
    "text",
    ["strain [%],stress [MPa]\n0,0\n0.1,3\n", "strain (%)\tstress (MPa)\n0\t0\n0,1\t3\n", "# machine 7\nstrain;stress\n%;MPa\n0;0\n\n0,1;3,0\n",
     "\ufeffstrain [mm/m], stress [N/mm²]\n0, 0\n1, 3\n"],
)  # fmt: skip
def test_curves_of_laboratories(tmp_path, text):
    (tmp_path / "c.csv").write_text(text, encoding="utf-8")
    curve = Curve.from_csv(tmp_path / "c.csv")
    assert (curve.x_name, curve.y_name, curve.x_unit, curve.y_unit) == ("strain", "stress", "1", "Pa")
    assert curve.x == pytest.approx([0, 1e-3]) and curve.y == pytest.approx([0, 3e6])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("strain,stress\n0,0\n1,1\n", "'strain' has no unit; write it in the header"),
        ("strain [1],stress [ksi]\n0,0\n1,1\n", "column 'stress': the unit 'ksi' is not known"),
        ("strain [1],stress [MPa]\n0,0\n1,one\n", "c.csv:3: 'stress' is 'one'; give a number"),
        ("strain [1],stress [MPa]\n0,0\n1\n", "c.csv:3: 'stress' is ''"),
        ("t [s],strain [1],stress [MPa]\n0,0,0\n1,1,1\n", "columns t, strain, stress; choose two"),
        ("strain [1]\n0\n1\n", "is one column"),
        ("strain [1],stress [MPa]\n0,0\n", "has 2 lines"),
    ],
)  # fmt: skip
def test_curves_that_cannot_be_read(tmp_path, text, message):
    (tmp_path / "c.csv").write_text(text)
    with pytest.raises(concordem.InferenceError) as caught:
        Curve.from_csv(tmp_path / "c.csv")
    assert message in str(caught.value)


LINE = np.linspace(0.0, 1.0, 5)
NINE = np.linspace(1.0, 2.0, 9)[:, None]


def line():
    return Ensemble.from_arrays([Parameter("a", 1.0, 2.0)], NINE, curves={"f": (LINE, NINE * LINE)}, units={"f": "Pa", "x of f": "1"})


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Parameter("a", 2.0, 1.0), "'a' ranges from 2.0 to 1.0"),
        (lambda: Parameter("a", 0.0, 1.0, "log"), "give a positive bound"),
        (lambda: Parameter("a", 0.0, 1.0, "cubic"), "'cubic'; give 'linear' or 'logarithmic'"),
        (lambda: Ensemble.from_model(lambda v: v, {"a": (1, 2)}, count=3), "at least 6 points"),
        (lambda: Ensemble.from_model(lambda v: v, {"a": 3}), "range of 'a' is 3"),
        (lambda: Ensemble.from_model(lambda v: v, {"a": ("1 Pa", "2 m")}), "give the same unit"),
        (lambda: Ensemble.from_model(lambda v: 1.0, {"a": (1, 2)}), "returns no dictionary"),
        (lambda: Ensemble.from_model(lambda v: LINE, {"a": (1, 2)}, x=[0, 1]), "give (64, 2)"),
        (lambda: Ensemble.from_arrays([Parameter("a", 1.0, 1.5)], NINE, scalars={"f": NINE[:, 0]}), "outside of its range"),
        (lambda: Ensemble.from_arrays([Parameter("a", 1.0, 2.0)], NINE), "neither curves nor numbers"),
        (lambda: Ensemble.from_arrays([Parameter("a", 1.0, 2.0)], NINE, curves={"f": (LINE[::-1], NINE * LINE)}), "sort it"),
        (lambda: Ensemble.from_arrays([Parameter("a", 1.0, 2.0)], NINE, scalars={"f": NINE[:, 0]}, units={"g": "Pa"}), "units has 'g'"),
        (lambda: posterior(line(), (LINE, LINE), noise=0.0), "is not positive"),
        (lambda: posterior(line(), (LINE, LINE), noise="0.1 mm"), "is in m, the ensemble in Pa"),
        (lambda: posterior(line(), Curve(LINE, LINE, y_unit="N")), "is in N, the ensemble in Pa"),
        (lambda: posterior(line(), (2 * LINE, LINE)), "cut it with curve.within(0, 1)"),
        (lambda: posterior(line(), (-LINE, LINE)), "turn the signs of x and y: compression is negative"),
        (lambda: posterior(line(), {"g": (LINE, LINE)}), "has no 'g'; it has f"),
        (lambda: posterior(line(), (LINE, LINE), noise={"g": 1.0}), "noise names g, measured are f"),
        (lambda: posterior(line(), (LINE, LINE), noise=[1.0, 2.0]), "has the shape (2,)"),
        (lambda: posterior(line(), (LINE, LINE), noise=1.0, priors={"a": 3}), "give a distribution"),
        (lambda: posterior(line(), (LINE, LINE), noise=1.0, priors={"b": 3}), "there is a prior of 'b'"),
        (lambda: posterior(line(), (LINE, LINE), noise=1.0, specimens=0), "specimens is 0"),
        (lambda: posterior(line(), (LINE[:3], LINE[:3])), "cannot be estimated from 3 values"),
        (lambda: posterior(line(), 3.0), "give a Curve, a CSV file"),
        (lambda: posterior("ensemble.h5", 3.0), "Ensemble.from_sweep"),
        (lambda: Curve([0.0, np.nan], [0.0, 1.0]), "x[1] of the curve is nan"),
        (lambda: Curve([0.0, 1.0], [0.0]), "two arrays of equal length"),
        (lambda: Curve(LINE, LINE).within(2, 3), "0 points of the curve"),
    ],
)  # fmt: skip
def test_refusals_say_what_to_do(call, message):
    with pytest.raises(concordem.InferenceError) as caught:
        call()
    assert message in str(caught.value)


def test_runs_without_numbers_are_left_out():
    y = NINE * LINE
    y[2, 3] = np.nan
    with pytest.warns(concordem.ConcordemWarning, match="1 of 9 runs have no finite values and are left out, the first is run 2"):
        assert len(Ensemble.from_arrays([Parameter("a", 1.0, 2.0)], NINE, curves={"f": (LINE, y)})) == 8


def test_missing_files_and_packages(tmp_path, monkeypatch):
    for read in (Ensemble.from_sweep, Ensemble.load):
        with pytest.raises(FileNotFoundError, match="does not exist"):
            read(tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("text")
    for read in (Ensemble.from_sweep, Ensemble.load):
        with pytest.raises(concordem.InferenceError, match="is no"):
            read(tmp_path / "text.npz")
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(ImportError, match=r"emcee is missing; install it with: python -m pip install 'concordem\[inference\]'"):
        quiet(line(), (LINE, LINE), noise=0.1)


def test_thinned_curve():
    curve = Curve(np.arange(100.0), 2 * np.arange(100.0)).thinned(10)
    assert curve.x == pytest.approx(np.arange(4.5, 100, 10)) and curve.y == pytest.approx(2 * curve.x)
