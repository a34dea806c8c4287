"""Packings, elastic constants, calibration, result files, documentation examples, other libraries in the process."""

import doctest
import importlib.util
import subprocess
import sys

import concordem
import concordem._memoized
import concordem._plot
import concordem._types
import numpy as np
import pytest
from concordem import packing


def test_documentation_examples():
    tried = 0
    modules = [concordem, concordem.operators, packing, concordem._types, concordem._memoized]
    # The examples of plots need matplotlib, which is optional.
    modules += [concordem._plot] if importlib.util.find_spec("matplotlib") else []
    for module in modules:
        outcome = doctest.testmod(module)
        assert outcome.failed == 0
        tried += outcome.attempted
    assert tried > 15


def test_lattices_and_files(tmp_path):
    face = packing.lattice("face-centered", 0.5, (3, 3, 3))
    # Touching spheres are neighbors up to rounding.
    summary = packing.summary(*face, interaction_ratio=1.001)
    assert summary.coordination == 12 and summary.packing_fraction == pytest.approx(np.pi / np.sqrt(18), abs=1e-12)
    packing.write(tmp_path / "p.txt", *face)
    back = packing.read(tmp_path / "p.txt")
    assert np.array_equal(back.positions, face.positions) and np.array_equal(back.radii, face.radii)
    assert np.array_equal(back.cell, face.cell)
    with pytest.raises(ValueError, match="simple-cubic"):
        packing.lattice("cubic", 0.5, (1, 1, 1))
    with pytest.raises(concordem.PackingError):
        packing.lattice("simple-cubic", -1.0, (1, 1, 1))


def test_random_packings_are_dense_and_reproducible():
    one = packing.random_dense(200, 1e-3, dispersion=0.2, seed=3, threads=1)
    two = packing.random_dense(200, 1e-3, dispersion=0.2, seed=3, threads=2)
    assert np.array_equal(one.positions, two.positions)
    assert 0.60 < packing.summary(*one).packing_fraction < 0.68
    assert sorted(packing.spatial_order(one.positions)) == list(range(200))




def test_elastic_constants_and_calibration():
    scenario = concordem.Scenario.template("cpm-periodic")
    data = scenario.to_dict()
    data["packing"]["count"] = 200
    scenario = concordem.Scenario.from_dict(data)
    answers = concordem.elastic_constants(scenario)
    assert answers.static.young < answers.affine.young < 1.5 * answers.static.young
    assert np.allclose(answers.static.stiffness @ answers.static.compliance, np.eye(6), atol=1e-12)
    assert answers.relaxed is None and answers.links > 200
    fit = concordem.calibrate_elastic(scenario, 30e9, 0.2)
    assert fit.achieved.young == pytest.approx(30e9, rel=1e-9) and fit.achieved.poisson == pytest.approx(0.2, abs=1e-8)
    data["material"][0]["cpm"]["young"] = fit.normal
    data["material"][0]["cpm"]["shear_ratio"] = fit.shear_ratio
    again = concordem.elastic_constants(concordem.Scenario.from_dict(data)).static
    # The error of the constants is quadratic in the residual of the static solution, 1e-11; the search for Poisson's ratio stops at 1e-9.
    assert again.young == pytest.approx(30e9, rel=1e-7) and again.poisson == pytest.approx(0.2, abs=1e-7)
    with pytest.raises(concordem.CalibrationError, match="out of reach"):
        concordem.calibrate_elastic(scenario, 30e9, 0.45)
    with pytest.raises(concordem.StaticsError, match="periodic"):
        concordem.elastic_constants(concordem.Scenario.template("cpm-small"))


def cell():
    """A small bonded cell."""
    data = concordem.Scenario.template("cpm-periodic").to_dict()
    data["packing"]["count"] = 120
    return concordem.Scenario.from_dict(data)


@pytest.mark.once
@pytest.mark.parametrize(
    "law, options, found",
    [
        ("cpm", {}, {"cpm.young", "cpm.shear_ratio"}),
        ("linear_bond", {}, {"linear_bond.normal_stiffness", "linear_bond.shear_stiffness"}),
        (
            "linear_bond",
            {"deformable": True, "particle_poisson": 0.3, "particle_softness": 0.1},
            {"linear_bond.normal_stiffness", "linear_bond.shear_stiffness", "deformable.young"},
        ),
        ("cohesive_beam", {}, {"cohesive_beam.young", "cohesive_beam.radius_ratio"}),
    ],
)
def test_every_law_is_calibrated_as_by_the_program(tmp_path, law, options, found):
    """The calibrated scenario has the requested constants and equals that of the program."""
    source, written = tmp_path / "cell.toml", tmp_path / "found.toml"
    source.write_text(cell().text)
    fit = concordem.calibrate_elastic(concordem.Scenario.from_file(source), 30e9, 0.19, law=law, **options)
    assert set(fit.parameters) == found and fit.normal == fit.parameters[next(iter(fit.parameters))]
    again = concordem.elastic_constants(fit.scenario).static
    assert again.young == pytest.approx(30e9, rel=1e-7) and again.poisson == pytest.approx(0.19, abs=1e-7)
    assert (fit.spectral_radius is None) == (not options)
    if options:
        # In (0, 1), the strain-force iteration converges.
        assert 0 < fit.spectral_radius < 1 and fit.scenario.to_dict()["material"][0]["deformable"]["poisson"] == 0.3
    words = ["calibrate", "elastic", str(source), "--young", "30e9", "--poisson", "0.19", "--law", law, "-o", str(written)]
    for key, value in options.items():
        words += ["--" + key.replace("_", "-")] + ([] if value is True else [str(value)])
    run = subprocess.run([sys.executable, "-m", "concordem", *words], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert written.read_text() == fit.scenario.text


def test_calibrations_that_cannot_be():
    scenario = cell()
    for options, message in [
        ({"law": "glue"}, 'law is "glue"; choose "cpm", "linear_bond", "cohesive_beam", or "jointed"'),
        ({"deformable": True}, 'deformable: the law "cpm" .* use law="linear_bond"'),
        ({"particle_poisson": 0.3}, "particle_poisson is for deformable particles; add deformable"),
        ({"law": "linear_bond", "deformable": True, "particle_poisson": 0.7}, "particle_poisson is 0.7; it must be more than -1"),
        ({"law": "linear_bond", "deformable": True, "particle_softness": -1.0}, "particle_softness is -1; it must be positive"),
    ]:
        with pytest.raises(ValueError, match=message):
            concordem.calibrate_elastic(scenario, 30e9, 0.2, **options)
    with pytest.raises(ValueError, match='give a scenario, or choose a law .*: law="cpm"'):
        concordem.calibrate_elastic(None, 30e9, 0.2)
    with pytest.raises(concordem.CalibrationError, match="particle_softness=9: .* would not converge"):
        concordem.calibrate_elastic(scenario, 30e9, 0.2, law="linear_bond", deformable=True, particle_softness=9.0)


def test_results_beside_h5py_and_vtk(tmp_path):
    """Each of the three libraries has its own HDF5; in one process they must not conflict."""
    h5py = pytest.importorskip("h5py")
    vtk = pytest.importorskip("vtk")
    assert vtk.vtkVersion.GetVTKVersion()
    with h5py.File(tmp_path / "theirs.h5", "w") as file:
        file["x"] = np.arange(3.0)
    simulation = concordem.Scenario.template("hertz-impact").simulation()
    simulation.step(5)
    simulation.save(tmp_path / "ours.h5")
    with h5py.File(tmp_path / "ours.h5") as file:
        assert np.array_equal(file["state/particles/position"][:].reshape(-1, 3), simulation.state.positions)
    assert concordem.Simulation.load(tmp_path / "ours.h5").state_hash() == simulation.state_hash()
    with h5py.File(tmp_path / "theirs.h5") as file:
        assert file["x"][2] == 2


def test_results_that_are_not(tmp_path):
    # Every reader of files, with the class that Python itself would raise; of results it is a ResultError as well.
    missing = tmp_path / "missing.h5"
    for read in (
        concordem.Result, concordem.Simulation.load, concordem.report, concordem.export, concordem.resume, concordem.measure,
        concordem.Scenario.from_file, concordem.check, concordem.run, concordem.sweep, concordem.packing.read, concordem.characterise,
    ):
        with pytest.raises(FileNotFoundError, match="missing"):
            read(missing)
    with pytest.raises(concordem.ResultError, match="missing"):
        concordem.Result(tmp_path / "missing.h5")
