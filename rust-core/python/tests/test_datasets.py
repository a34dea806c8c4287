"""Strain paths of representative cells: shapes, physics, resumption, equal bytes."""

import subprocess
import sys
import textwrap

import concordem
import numpy as np
import pytest
from concordem import datasets

pytestmark = pytest.mark.once
pytest.importorskip("h5py")

OPTIONS = {"count": 6, "steps": 4, "batch": 3, "packings": (1, 2), "amplitude": 4e-4}


@pytest.fixture(scope="module")
def cell():
    tables = concordem.Scenario.template("cpm-periodic").with_settings({"packing.count": 60}).to_dict()
    return concordem.Scenario.from_dict({name: table for name, table in tables.items() if name != "loading"} | {"stop": {"steps": 1}})


def test_tables_that_the_paths_replace_are_named(cell, tmp_path):
    given = concordem.Scenario.from_dict(cell.to_dict() | {"stop": {"time": 1.0, "steps": 9}})
    options = {"count": 1, "steps": 1, "threads": 1}
    with pytest.warns(concordem.ConcordemWarning, match=r"take the place of stop.time; remove this"):
        datasets.strain_paths(given, tmp_path / "given", **options)
    datasets.strain_paths(cell, tmp_path / "cell", **options)
    first, second = (datasets.load(tmp_path / name) for name in ("given", "cell"))
    assert all(np.array_equal(first[name], second[name]) for name in second)


@pytest.fixture(scope="module")
def folder(cell, tmp_path_factory):
    path = tmp_path_factory.mktemp("paths")
    datasets.strain_paths(cell, path, **OPTIONS, threads=1, stiffness=True)
    return path


def bytes_of(path):
    return {file.name: file.read_bytes() for file in sorted(path.iterdir())}


def test_what_is_written(folder):
    found = datasets.load(folder)
    assert {name: data.shape for name, data in found.items()} == {
        "bonds": (6, 5), "couple_stress": (6, 5, 3, 3), "damage": (6, 5, 6), "kind": (6,), "packing": (6,), "path": (6,), "stiffness": (6, 5, 6, 6), "strain": (6, 5, 6),
        "stress": (6, 5, 6), "work": (6, 5)}  # fmt: skip
    assert found["packing"].tolist() == [1, 1, 1, 2, 2, 2] and found["kind"].tolist() == [0, 1, 2] * 2 and found["path"].tolist() == [*range(6)]
    assert not any(found[name][:, 0].any() for name in ("strain", "damage", "work"))
    # Rounding.
    assert np.abs(found["stress"][:, 0]).max() < 1e-10 * np.abs(found["stress"]).max()
    tensor = found["strain"] * [1, 1, 1, 2**-0.5, 2**-0.5, 2**-0.5]
    largest = np.sqrt((tensor**2).sum(2)).max(1)
    assert (largest > 0.3 * 4e-4).all() and (largest < 4e-4).all()
    # A proportional path: the strain keeps its direction.
    direction = found["strain"][1, 1:] / np.linalg.norm(found["strain"][1, 1:], axis=1)[:, None]
    assert np.ptp(direction, axis=0).max() < 1e-12


def test_small_strains_give_the_stress_of_the_stiffness(cell, tmp_path):
    datasets.strain_paths(cell, tmp_path, count=2, steps=1, amplitude=1e-6, kinds=["proportional"], substeps=4000, stiffness=True, threads=1)
    found = datasets.load(tmp_path)
    expected = np.einsum("pij,pj->pi", found["stiffness"][:, 0], found["strain"][:, 1])
    # Damped waves of the loading are left over.
    assert found["stress"][:, 1] == pytest.approx(expected, abs=0.02 * np.abs(expected).max())
    energy = 0.5 * (expected * found["strain"][:, 1]).sum(1)
    assert found["work"][:, 1] == pytest.approx(energy, rel=0.1)


def test_damage_grows_and_bonds_break(cell, tmp_path):
    datasets.strain_paths(cell, tmp_path, count=1, steps=6, amplitude=0.02, kinds=["proportional"], substeps=200, threads=1)
    found = datasets.load(tmp_path)
    trace = found["damage"][0, :, :3].sum(1)
    assert (np.diff(trace) > -1e-12).all() and trace[-1] > 0.1
    assert (np.diff(found["bonds"][0]) <= 0).all() and found["bonds"][0, 0] == 1


def test_equal_bytes_after_interruption_and_for_any_threads(cell, folder, tmp_path):
    script = textwrap.dedent(f"""
        import os, sys, concordem
        from concordem import datasets
        write = datasets._write
        def then_killed(*arguments):
            write(*arguments)
            os.kill(os.getpid(), 9)
        datasets._write = then_killed
        cell = concordem.Scenario.from_text({cell.text!r})
        datasets.strain_paths(cell, sys.argv[1], **{OPTIONS!r}, threads=2, stiffness=True)
    """)
    done = subprocess.run([sys.executable, "-c", script, str(tmp_path)], capture_output=True)
    assert done.returncode == -9
    (first,) = tmp_path.iterdir()
    before = first.stat().st_mtime_ns
    datasets.strain_paths(cell, tmp_path, **OPTIONS, threads=2, stiffness=True)
    assert first.stat().st_mtime_ns == before and bytes_of(tmp_path) == bytes_of(folder)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"count": 0}, "count is 0; give a whole number of at least 1"),
        ({"steps": 2.5}, "steps is 2.5"),
        ({"amplitude": 0.0}, "amplitude is 0.0; give a strain between 0 and 0.5"),
        ({"kinds": ["spiral"]}, "choose from random-walk, proportional, cyclic"),
        ({"packings": []}, "packings is empty"),
    ],
)
def test_refusals_say_what_to_do(cell, tmp_path, options, message):
    with pytest.raises(concordem.InferenceError, match=message):
        datasets.strain_paths(cell, tmp_path, **options)


def test_other_paths_are_not_mixed(cell, folder, tmp_path):
    with pytest.raises(concordem.InferenceError, match="other settings; choose another folder"):
        datasets.strain_paths(cell, folder, **{**OPTIONS, "seed": 2}, stiffness=True)
    with pytest.raises(FileNotFoundError, match="strain_paths"):
        datasets.load(tmp_path)
