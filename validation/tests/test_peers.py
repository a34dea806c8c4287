"""What peers are given beside spheres: meshes that turn, pairs of materials, and the second half of a run."""
import math

import numpy as np
import pytest
from concordem_validate import case as cases
from concordem_validate import difference, registry, scenario, selfcheck
from concordem_validate import start as starts
from concordem_validate.engines import concordem, liggghts, yade
from concordem_validate.errors import Unsupported
from conftest import need


@pytest.mark.parametrize("name", ["yade", "liggghts"])
def test_peers_continue_in_the_middle_of_contacts(tmp_path, name):
    need(name)
    task = next(t for t in cases.load("by-itself").tasks if t.variant == "restart")
    task.start = starts.state(task.scenario, task.folder)
    engine, folders = registry.ENGINES[name], [tmp_path / "whole", tmp_path / "two"]
    for folder in folders:
        folder.mkdir()
    whole = engine.run(task, folders[0], 100)
    assert difference.same_bits(whole, engine.run_in_two(task, folders[1], 100)) == []
    # half way the springs push: a run that loses them would differ
    speed = whole.series["velocity"]
    half = int(np.searchsorted(speed.steps, selfcheck.half_of(task)))
    assert np.abs(np.diff(speed.values[half - 1:half + 2], axis=0)).max(axis=(1, 2)).min() > 1e-3


def test_what_peers_cannot_continue_is_refused(tmp_path):
    task = cases.load("drum").tasks[0]
    task.start = starts.state(task.scenario, task.folder)
    with pytest.raises(Unsupported, match="without heat and meshes"):
        liggghts.ONE.run_in_two(task, tmp_path, 1)
    deformable = next(t for t in cases.load("ddem-peers").tasks if t.variant == "block")
    need("concordem")
    deformable.start = concordem.export_start(deformable, tmp_path)
    with pytest.raises(Unsupported, match="not saved with a scene"):
        yade.run_in_two(deformable, tmp_path, 1)


def test_meshes_and_interfaces_are_translated_or_refused():
    task = cases.load("drum").tasks[0]
    task.start = starts.state(task.scenario, task.folder)
    made = lambda **changes: cases.Task("a", "b", task.folder, scenario.changed(task.scenario, changes), None, start=task.start)
    data = yade.translation(task)
    triangles, material, center, spin = data["meshes"][0]
    assert (len(triangles), material, center, spin) == (64, 2, [0, 0, 0], [0, 10, 0])
    # as published: friction and restitution of M1 and M2 with each other and with steel
    assert [[mu, e] for a, b, mu, e in data["pairs"] if (a, b) != (2, 2)] == [[0.3, 0.5], [0.2, 0.45], [0.2, 0.4], [0.4, 0.4], [0.2, 0.4]]
    files, _ = liggghts.deck(task, 1)
    deck = files["in.txt"]
    assert "coefficientFriction peratomtypepair 3 0.3 0.2 0.2 0.2 0.4 0.2 0.2 0.2 0.2" in deck
    assert f"rotate origin 0.0 0.0 0.0 axis 0.0 1.0 0.0 period {math.tau / 10!r}" in deck and "n_meshes 1 meshes mesh0" in deck
    assert files["mesh0.stl"].count("facet normal") == 64
    for changes, message in (
        ({"interface.0.hertz_mindlin.young": "6 MPa"}, "Young's modulus 6000000 Pa"),
        ({"interface.0.hertz_mindlin.poisson": 0.3}, "one Poisson's ratio"),
        ({"interface.0.of": "M1"}, "interface with of"), ({"wall.0.motion.displacement": [0, 0, 1]}, "mesh with displacement"),
        ({"wall.0.shape.path": "a.stl"}, "mesh with path"), ({"history.0.shape.points": [[0, 0], [1, 1], [2, 0]]}, "history turn"),
        ({"wall.0.motion": "__remove__"}, "history turn"), ({"contacts.law": "frictional"}, "interface"),
        ({"prescribe": [{"set": "M2", "velocity": [0, 0, 0], "history": "turn"}]}, "history of prescribe"),
    ):
        for translation in (yade.translation, lambda one: liggghts.deck(one, 1)):
            with pytest.raises(Unsupported, match=message):
                translation(made(**changes))
