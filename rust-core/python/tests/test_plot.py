"""Curves with matplotlib, and tables for pandas."""

import subprocess
import sys

import concordem
import numpy as np
import pytest
from concordem import _plot


@pytest.fixture
def pyplot():
    """Pyplot without a window; all figures are closed at the end."""
    matplotlib = pytest.importorskip("matplotlib", reason="matplotlib is not installed")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    yield pyplot
    pyplot.close("all")


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A small specimen pulled until it breaks, as a simulation and as the result of the program."""
    folder = tmp_path_factory.mktemp("runs")
    # Four times the rate of the template: a fourth of the steps, and as many events.
    scenario = concordem.Scenario.template("cpm-small").with_settings({"packing.count": 100, "loading.strain_rate": "1.6 1/s"})
    (folder / "s.toml").write_text(scenario.text)
    command = [sys.executable, "-m", "concordem", "run", "--quiet", str(folder / "s.toml")]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    simulation = scenario.simulation(threads=2)
    simulation.run()
    return simulation, concordem.Result(folder / "s.h5"), folder / "s.h5"


def lines(axes):
    return {line.get_label().split()[0].strip(":"): line for line in axes.get_lines()}


def test_stress_and_strain_with_peak_and_modulus(pyplot, runs):
    simulation, result, file = runs
    info = subprocess.run([sys.executable, "-m", "concordem", "info", str(file)], capture_output=True, text=True, check=True).stdout
    told = [float(line.split()[1]) for line in info.splitlines() if line.split()[:1] == ["E"]]
    strength = [float(line.split()[1]) for line in info.splitlines() if line.split()[:1] == ["f_t"]]
    for source in (simulation, result):
        axes = source.plot()
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("strain", "stress, Pa")
        curve, (peak, modulus) = axes.get_lines()[0], (lines(axes)[name] for name in ("peak", "E"))
        assert np.array_equal(curve.get_xdata(), source.samples["strain"])
        assert np.array_equal(curve.get_ydata(), source.samples["stress"])
        assert peak.get_ydata()[0] == source.samples["stress"].max()
        slopes = [modulus.get_ydata()[1] / modulus.get_xdata()[1]]
        gauged = lines(source.plot("gauge_strain", "stress"))["E"]
        slopes.append(gauged.get_ydata()[1] / gauged.get_xdata()[1])
        # The program prints four digits, the middle half first, as the legend does.
        assert np.array(slopes) / 1e9 == pytest.approx(told[::-1], rel=1e-3)
        assert modulus.get_label() == f"E = {told[0]:.4g} GPa in the middle half, {told[1]:.4g} GPa between the ends"
        assert peak.get_ydata()[0] / 1e6 == pytest.approx(strength[0], rel=1e-3)


def test_properties_of_a_result_are_those_of_the_program(runs):
    _, result, file = runs
    info = subprocess.run([sys.executable, "-m", "concordem", "info", str(file)], capture_output=True, text=True, check=True).stdout
    told = [float(line.split()[1]) for line in info.splitlines() if line.split()[:1] in (["E"], ["f_t"])]
    found = result.properties
    # The program prints four digits.
    assert [found["E_gauge"] / 1e9, found["E"] / 1e9, found["f_t"] / 1e6] == pytest.approx(told, rel=1e-3)
    assert found["strain_at_peak"] == result.samples["strain"][result.samples["stress"].argmax()] and found["rises_at_end"] == 0


def test_the_modulus_is_fitted_up_to_thirty_percent():
    """A curve that bends at 35 % of its peak has the slope of its straight part, tension or compression, also with an offset."""
    strain = np.linspace(0, 1e-3, 201)
    stress = np.interp(strain, [0, 2e-4, 1e-3], [0, 4e6, 4e6 / 0.35])
    for sign in (1, -1):
        slope = _plot._slope(sign * strain + 1e-5, sign * stress, _plot._FITTED_SHARE * np.abs(stress).max())
        # Rounding.
        assert slope == pytest.approx(20e9, rel=1e-12)
    assert _plot._slope(strain[:2], stress[:2], 1e9) is None
    assert _plot._slope(np.zeros(5), stress[:5], 1e9) is None
    # Rounding errors of a specimen that is held, while heat or nothing loads it.
    assert _plot._slope(np.array([0, 1, -1, 2, 0, 1]) * 1e-17, stress[:6], 1e9) is None
    assert _plot._slope(strain[:6], np.array([1, -1, 1, -1, 1, -1]) * 1e-9, 1e9) is None


def test_axes_names_and_style(pyplot, runs):
    simulation, result, _ = runs
    axes = result.plot(y="broken", color="k", label="bonds")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time, s", "broken") and axes.get_legend() is None
    assert simulation.plot("strain", "stored_normal", axes=axes) is axes and len(axes.get_lines()) == 2
    # Labels that axes have stay.
    assert axes.get_lines()[0].get_color() == "k" and (axes.get_xlabel(), axes.get_ylabel()) == ("time, s", "broken")
    # A scale that a user has chosen stays.
    _, logarithmic = pyplot.subplots()
    logarithmic.set_yscale("log")
    assert concordem.plot(result, "time", "kinetic", axes=logarithmic).get_yscale() == "log"
    # A table has no scenario, so its test is unknown, and the slope may be no modulus.
    assert set(lines(concordem.plot(simulation.samples))) >= {"peak"}
    assert "E" not in lines(concordem.plot(simulation.samples))


def test_no_modulus_where_the_stress_is_another(pyplot):
    scenario = concordem.Scenario.template("concrete-splitting").with_settings({"packing.count": 100})
    simulation = scenario.simulation(threads=2)
    simulation.step(400)
    assert simulation.samples["stress"].any() and "E" not in lines(simulation.plot())
    assert not _plot._is_axial(simulation)
    assert _plot._is_axial(concordem.Scenario.template("beam-tension").with_settings({"packing.count": 100}).simulation(threads=2))
    direct = concordem.Scenario.template("cpm-small").with_settings({"packing.count": 100}).simulation(threads=2)
    direct.step(150)
    marks = lines(direct.plot())
    # The stress still rises: its largest value is no peak, but the slope is known.
    assert "peak" not in marks and "E" in marks


def test_without_loading_and_without_samples(pyplot):
    simulation = concordem.Scenario.template("hertz-impact").simulation(threads=1)
    assert simulation.plot().get_ylabel() == "kinetic, J"
    simulation.step(20)
    axes = simulation.plot()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time, s", "kinetic, J")
    assert np.array_equal(axes.get_lines()[0].get_ydata(), simulation.samples["kinetic"])
    # Zeros have neither peak nor slope.
    assert len(simulation.plot("strain", "stress").get_lines()) == 1


def test_operators_and_wrong_names(pyplot, runs):
    simulation, result, _ = runs
    with pytest.raises(ValueError, match="no quantity 'stres'; choose from: time, step, strain"):
        result.plot("strain", "stres")
    with pytest.raises(TypeError, match="x = 'strain' without y"):
        result.plot("strain")
    with pytest.raises(TypeError, match="named columns"):
        concordem.plot(np.ones(3))
    with pytest.raises(ValueError, match=r"several components \(3,\); plot one"):
        concordem.plot(simulation.events, "time", "position")
    with pytest.raises(TypeError, match="no default curve; choose x and y from: time, step, a, b"):
        concordem.plot(simulation.events)
    assert concordem.plot(simulation.events, "time", "energy").get_ylabel() == "energy, J"


def test_the_message_without_matplotlib():
    code = (
        "import sys; sys.modules['matplotlib'] = None; import concordem\n"
        "concordem.Scenario.template('hertz-impact').simulation(threads=1).plot()"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode and run.stderr.rstrip().endswith("matplotlib is missing; install it with: python -m pip install matplotlib")


def test_tables_of_pandas(runs):
    pandas = pytest.importorskip("pandas", reason="pandas is not installed")
    simulation, result, _ = runs
    for samples in (simulation.samples, result.samples):
        frame = pandas.DataFrame(samples)
        assert tuple(frame.columns) == samples.dtype.names and len(frame) == len(samples)
        for name in samples.dtype.names:
            assert np.array_equal(frame[name].to_numpy(), samples[name]), name
    # Vectors as the manual says.
    events = simulation.events
    frame = pandas.DataFrame({name: list(events[name]) for name in events.dtype.names})
    assert len(frame) == len(events) > 0 and np.array_equal(np.stack(frame["position"]), events["position"])


def test_axes_keep_their_labels(pyplot, runs, tmp_path):
    """A simulation that was just loaded, or has not begun, draws what the axes show."""
    simulation, _, _ = runs
    axes = simulation.plot()
    simulation.save(tmp_path / "state.h5")
    loaded = concordem.Simulation.load(tmp_path / "state.h5")
    assert np.array_equal(loaded.samples, simulation.samples)
    for other in (loaded, simulation.scenario.simulation()):
        other.plot(axes=axes)
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("strain", "stress, Pa")
    axes.set_ylabel("my stress")
    with pytest.raises(ValueError, match="the axes show 'my stress' over 'strain'"):
        loaded.plot(axes=axes)
    loaded.plot("strain", "stress", axes=axes)
    assert axes.get_ylabel() == "my stress"
