"""Running engines: missing, hanging, and crashing peers, stored runs, bitwise equal results."""
import math
import os
import shutil
import time
from pathlib import Path

import pytest
from concordem_validate import case as cases
from concordem_validate import cli, process, quirks, report, rounds, runner, scenario
from concordem_validate.engines import concordem, esys, lammps, liggghts, translate, yade
from concordem_validate.errors import Crashed, NotInstalled, TimedOut, Unsupported
from concordem_validate.result import Result
from conftest import FOLDER, need


def test_a_hanging_engine_is_stopped_with_its_children(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "getloadavg", lambda: (0.0, 0.0, 0.0))
    start = time.perf_counter()
    with pytest.raises(TimedOut, match="hello"):
        process.run(["bash", "-c", "echo hello; sleep 600 & echo $! >child; wait"], tmp_path, 0.5)
    # long before the engine ends by itself, also where the machine is busy
    while _lives((tmp_path / "child").read_text().strip()):
        assert time.perf_counter() - start < 300
        time.sleep(0.01)


def _lives(number):
    try:
        return Path("/proc", number, "stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_an_engine_gets_its_time_on_a_busy_machine(tmp_path, monkeypatch):
    """The time limit is that of a run alone: with a hundred runs for each processor it is a hundred times as long, while they are there."""
    for before, after, enough in ((0, 0, False), (100, 100, True), (0, 100, True), (2, 0, False)):
        loads = iter([before])
        monkeypatch.setattr(os, "getloadavg", lambda: (next(loads, after) * os.cpu_count(), 0.0, 0.0))
        if enough:
            process.run(["sleep", "0.4"], tmp_path, 0.2)
        else:
            with pytest.raises(TimedOut, match="time limit of 0.2 s"):
                process.run(["sleep", "600"], tmp_path, 0.2)


def test_a_crashing_engine_is_reported_with_its_last_words(tmp_path):
    with pytest.raises(Crashed, match="code 3.*it broke"):
        process.run(["bash", "-c", "echo it broke; exit 3"], tmp_path, 10)


def test_strengths_that_scatter_are_not_dropped():
    scattered = {"packing": {}, "contacts": {"law": "none"}, "material": [{"name": "glass", "strength_scatter": {"weibull_modulus": 8}}]}
    with pytest.raises(Unsupported, match="yade: no translation of material.strength_scatter"):
        translate.check_keys(scattered, "yade")


def test_a_missing_peer_is_said_to_a_user_and_fails_in_ci(tmp_path, monkeypatch):
    need("concordem")

    def gone():
        raise NotInstalled("YADE is not installed: apt install yade")

    monkeypatch.setattr(yade, "version", gone)
    case = cases.load("cpm-bond").only(["compression"], ["yade", "analytic"])
    round_ = runner.Runner(tmp_path, quiet=True).run([case])
    assert round_.outcomes["cpm-bond", "compression", "yade"].status == "missing"
    assert {v.status for v in round_.verdicts} == {"pass", "missing"}
    assert not round_.failed(strict=False) and round_.failed(strict=True)
    assert "apt install yade" in report.text([case], round_, True)
    page = report.write(tmp_path / "report.html", [case], round_, quirks.load()).read_text()
    assert "apt install yade" in page and "not installed" in page


@pytest.mark.parametrize("name, remedy", [("lammps", ".ci/setup lammps"), ("esys", "apt install esys-particle")])
def test_missing_peers_of_beams_are_said_with_their_remedy(tmp_path, monkeypatch, name, remedy):
    need("concordem")
    monkeypatch.setenv(lammps.VARIABLE, str(tmp_path / "none"))
    monkeypatch.setenv("PATH", str(tmp_path))
    case = cases.load("beam-cantilever").only(["pull"], [name])
    round_ = runner.Runner(tmp_path, quiet=True).run([case])
    outcome = round_.outcomes["beam-cantilever", "pull", name]
    assert outcome.status == "missing" and remedy in outcome.message
    assert {v.status for v in round_.verdicts} == {"missing"}
    assert round_.exit_code(strict=False) == rounds.NOTHING_CHECKED and round_.exit_code(strict=True) == rounds.ENGINE_MISSING
    assert remedy in report.text([case], round_, True)
    page = report.write(tmp_path / "report.html", [case], round_, quirks.load()).read_text()
    assert remedy in page and "not installed" in page


def test_operators_of_a_missing_peer_are_missing(tmp_path, monkeypatch):
    need("concordem")

    def gone():
        raise NotInstalled("YADE is not installed: apt install yade")

    monkeypatch.setattr(yade, "version", gone)
    case = cases.load("operators").only(["cloud"], ["yade"])
    round_ = runner.Runner(tmp_path, quiet=True).run([case])
    assert {o.status for o in round_.outcomes.values()} == {"missing"}
    assert round_.exit_code(strict=False) == rounds.NOTHING_CHECKED and round_.exit_code(strict=True) == rounds.ENGINE_MISSING


# every law, walls, deformable particles, a peer's state: one variant per code path of the solver
ROUND = [("cpm-bond", ["mixed"], []), ("slip-to-roll", ["finite", "yade-spinning"], []), ("hertz-oblique", ["main"], []),
         ("ddem-peers", ["block"], []), ("beam-cantilever", ["kick"], []), ("bar-fracture", ["main"], []), ("cpm-cell", ["plain"], []),
         ("granular-settling", ["seed-1"], []), ("operators", ["cloud"], ["yade"]), ("lattice-elasticity", ["fcc-0-4"], [])]


def test_two_rounds_from_nothing_give_the_same_bits(tmp_path, capsys):
    """Runs that are stored for the rounds of the suite, each made from nothing, and the same once more."""
    need("concordem", "yade", "operators")
    few = lambda: [cases.load(name).only(variants, peers) for name, variants, peers in ROUND]
    folders = tmp_path / "a", tmp_path / "b"
    stored = runner.Runner(FOLDER, quiet=True).run(few())
    fresh = runner.Runner(folders[1], quiet=True).run(few())
    for outcomes in (stored.outcomes.values(), fresh.outcomes.values()):
        assert all(o.status == "done" for o in outcomes), [o.message for o in outcomes]
    assert not any(o.kept for o in fresh.outcomes.values())
    (folders[0] / "runs").mkdir(parents=True)
    for outcome in stored.outcomes.values():
        shutil.copy(outcome.path, folders[0] / "runs")
    assert cli.main(["compare", *map(str, folders)]) == 0
    assert "12 results compared, all bitwise equal" in capsys.readouterr().out
    # one changed bit is detected, and so is a missing result
    path = next((folders[1] / "runs").glob("slip-to-roll.finite.concordem.*.h5"))
    result = Result.read(path)
    result.series["velocity"].values.reshape(-1).view("u8")[-3] ^= 1
    result.write(path)
    next((folders[1] / "runs").glob("cpm-bond.*.concordem.*.h5")).unlink()
    assert cli.main(["compare", *map(str, folders)]) == 1
    out = capsys.readouterr().out
    assert "series/velocity differs" in out and "in one round only" in out
    assert cli.main(["compare", str(tmp_path / "a"), str(tmp_path)]) == 2


def test_unsupported_scenarios_of_beams_are_rejected(tmp_path):
    need("concordem")
    task = next(t for t in cases.load("beam-cantilever").tasks if t.variant == "pull")
    start = concordem.export_start(task, tmp_path)
    for translation in (lammps.deck, esys.translation):
        for changes, message in (
            ({"integration.gravity": [0, 0, "-9.81 m/s^2"]}, "loads and walls"),
            ({"integration.damping": {"kind": "local", "coefficient": 0.1}}, "local damping"),
            ({"prescribe.0.velocity": ["free", 0, 0]}, "fully fixed at rest"),
            ({"material.0.cohesive_beam.model": "spring"}, "euler-bernoulli or timoshenko"),
            ({"material.0.cohesive_beam.tensile_strength": "1 MPa"}, "tensile_strength"),
            ({"bonds.law": "linear_bond"}, "only cohesive beams"), ({"deformable": {}}, "deformable"),
        ):
            other = cases.Task("a", "b", task.folder, scenario.changed(task.scenario, changes), None, start=start)
            with pytest.raises(Unsupported, match=message):
                translation(other)
    files, steps, radius = lammps.deck(task.__class__(**{**task.__dict__, "start": start}))
    assert steps == 4000 and radius == 1e-3 and "bond_style bpm/rotational" in files["in.txt"]
    assert esys.translation(task.__class__(**{**task.__dict__, "start": start}))["held"] == [0]


def test_strains_of_particles_are_translated_or_refused(tmp_path):
    need("concordem")
    task = next(t for t in cases.load("ddem-peers").tasks if t.variant == "block")
    start = concordem.export_start(task, tmp_path)
    how = yade.translation(cases.Task("a", "b", task.folder, task.scenario, None, start=start))["deformable"]
    assert how["condition"] == "solid" and how["constants"] == [[100e6, 0.3]]
    # the force pushes on the near side, so its virial is compressive
    assert how["load"][0][0][0] == pytest.approx(-1e-3 * 0.02**2 / (0.02**2 + 0.005**2 + 0.003**2) ** 0.5, rel=1e-12)
    for changes, message in (({"deformable.update": "iterated"}, "step before"), ({"deformable.dashpots": True}, "dashpots"),
                             ({"prescribe": [{"set": "face", "velocity": [0, 0, 0]}]}, "prescribed motion")):
        other = cases.Task("a", "b", task.folder, scenario.changed(task.scenario, changes), None, start=start)
        with pytest.raises(Unsupported, match=message):
            yade.translation(other)


def test_laboratory_tests_are_translated_or_refused(tmp_path):
    need("concordem")
    beam, cell, disc = (next(iter(cases.load(name).tasks)) for name in ("notched-beam", "triaxial-cell", "splitting-disc"))
    starts = {}
    for task in (beam, cell, disc):
        starts[task.case] = concordem.export_start(task, tmp_path)
    made = lambda task, **changes: cases.Task(
        task.case, "b", task.folder, scenario.changed(task.scenario, changes.pop("changes", {})), None, start=starts[task.case])
    data = yade.translation(made(beam))
    position, bonds = starts["notched-beam"].position, {tuple(pair) for pair in starts["notched-beam"].bonds.tolist()}
    assert data["severed"] and not bonds & {tuple(pair) for pair in data["severed"]}
    for a, b in data["severed"]:
        assert (position[a, 0] - 5e-5) * (position[b, 0] - 5e-5) <= 0 and min(position[a, 2], position[b, 2]) < -1e-3
    loading = data["loading"]
    # 3 a/(b h^2), a = 21 mm, and 3 h/(a (3 l - 4 a))
    assert loading["stress"] == pytest.approx(3 * 0.021 / 1e-6, rel=1e-12)
    assert loading["strain"] == pytest.approx(3 * 0.01 / (0.021 * (0.126 - 0.084)), rel=1e-12)
    assert {data["fixed"][p] for p in loading["held"] + loading["moved"]} == {"z"}
    assert all(data["velocity"][p][2] == -0.03 for p in loading["moved"])
    first, second = yade.translation(made(cell))["loading"]["phases"]
    assert (first["mask"], second["mask"], second["goal"][:2]) == (7, 3, [-5e6, -5e6]) and second["fastest"] == [100, 100, 3]
    data = yade.translation(made(disc))
    assert [wall[3][2] for wall in data["walls"]] == [0.15, -0.15] and data["loading"]["area"] == pytest.approx(3.141592653589793 * 1.2e-4)
    for task, changes, message in (
        (beam, {"cut.0.shape": {"kind": "sphere", "center": [0, 0, 0], "radius": 1e-3}}, "cut of kind sphere"),
        (beam, {"loading.strip_width": "__remove__", "loading.roller_radius": 1e-3}, "rollers as walls"),
        (beam, {"stage": [{"name": "a", "stop": {"steps": 2}}]}, "only for cell-stress"),
        (cell, {"stage.0.stop": {"unbalanced": 1e-3}}, "stop.steps"), (cell, {"stage.1.rate": -1}, "without rate"),
        (cell, {"loading.stress.0.1": 1.0}, "no shear"), (disc, {"loading.area": "hull"}, "explicit loading.area"),
        (disc, {"dimension": 2}, "dimension"), (disc, {"bonds.face_correction": True}, "face_correction"),
        (disc, {"loading.strip_width": 4e-3, "loading.area": 1e-4}, "stress is that of splitting"),
    ):
        with pytest.raises(Unsupported, match=message):
            yade.translation(made(task, changes=changes))
    for load in (translate.platens, translate.flexure):
        with pytest.raises(Unsupported, match="in two dimensions"):
            load(scenario.changed(beam.scenario, {"dimension": 2}), starts["notched-beam"])
    with pytest.raises(Unsupported, match="local damping"):
        liggghts.deck(made(disc), 1)
    with pytest.raises(Unsupported, match="strip_width"):
        translate.platens(scenario.changed(disc.scenario, {"loading.strip_width": 4e-3}), starts["splitting-disc"])
    undamped = {"integration.damping": {"kind": "none"}}
    with pytest.raises(Unsupported, match="linear contacts"):
        liggghts.deck(made(disc, changes=undamped), 1)


def test_hanging_peer_leaves_the_rest_whole(tmp_path):
    need("concordem", "yade")
    case = cases.load("cpm-bond").only(["compression"], ["yade", "analytic"])
    made = runner.Runner(tmp_path, quiet=True)
    task = case.tasks[0]
    # YADE starts in a second, however much longer it may take because of the load
    out = made.one(task, "yade", 0.01)
    assert out.status == "timeout" and "stopped" in out.message
    assert made.one(task, "analytic", 60).status == "done"


def test_finished_runs_are_kept_and_bits_are_equal(tmp_path):
    need("concordem")
    case = cases.load("cpm-bond").only(["cyclic-shear"], ["analytic"])
    first = runner.Runner(tmp_path, quiet=True).run([case])
    again = runner.Runner(tmp_path, quiet=True).run([case])
    fresh = runner.Runner(tmp_path, quiet=True, fresh=True).run([case])
    key = ("cpm-bond", "cyclic-shear", "concordem")
    assert not first.outcomes[key].kept and again.outcomes[key].kept and not fresh.outcomes[key].kept
    hashes = {r.outcomes[key].result().provenance["state_hash"] for r in (again, fresh)}
    assert len(hashes) == 1
    assert len(first.outcomes[key].result().provenance["state_hash"]) >= 32


def test_what_cannot_be_translated_is_refused(tmp_path):
    need("concordem")
    task = cases.load("cpm-bond").tasks[0]
    start = concordem.export_start(task, tmp_path)
    assert start.bonds.tolist() == [[0, 1]] and start.reference_length.tolist() == [2.0]
    assert start.mass[0] == pytest.approx(4800 * 4 / 3 * 3.141592653589793, rel=1e-15)
    for changes, message in (
        ({"dimension": 2}, "dimension"),
        ({"stop": {"strain": 1e-3}}, "fixed number of steps"), ({"material.0.cpm.mode": "woo"}, "woo"),
        ({"integration.damping": {"kind": "nonviscous", "coefficient": 0.1}}, "nonviscous"),
        ({"loading": {"kind": "torsion", "rate": 1}}, "torsion"),
        ({"loading": {"kind": "cell-strain", "velocity_gradient": [[0, 0, 0]] * 3}}, "prescribed motion in a driven cell"),
    ):
        other = cases.Task("a", "b", task.folder, scenario.changed(task.scenario, changes), None, start=start)
        with pytest.raises(Unsupported, match=message):
            yade.translation(other)
    periodic = scenario.changed(task.scenario, {"packing.cell": [1, 1, 1]})
    with pytest.raises(Unsupported, match="periodic"):
        liggghts.deck(cases.Task("a", "b", task.folder, periodic, None, start=start), 1)
    for changes, message in (
        ({"integration.damping": {"kind": "local", "coefficient": 0.1}}, "local damping"),
        ({"force": [{"set": "moved", "moment": [0, 0, 1.0]}]}, "moments"),
        ({"wall": [{"name": "floor", "material": "concrete", "shape": {"kind": "plane"}}]}, "walls"),
        ({"prescribe": [{"set": "held", "angular_velocity": [0, "free", 0]}]}, "all axes or none"),
        ({"contacts.law": "none", "bonds": "__remove__"}, "no native model"),
    ):
        other = cases.Task("a", "b", task.folder, scenario.changed(task.scenario, changes), None, start=start)
        with pytest.raises(Unsupported, match=message):
            liggghts.deck(other, 1)
    files, steps = liggghts.deck(cases.Task("a", "b", task.folder, task.scenario, None, start=start), 1)
    assert files["bonds.txt"] == "1 2 2.0\n" and steps == task.scenario["stop"]["steps"]
    deck = files["in.txt"]
    # reactions are summed after our fix has added its forces; an integrator without rotations fixes rotations
    assert deck.index("concordem/bond cpm") < deck.index("fix held0 held0 setforce 0.0 0.0 0.0") < deck.index("nve/sphere")
    assert "fix integrate_still still nve\n" in deck and "pair_style" not in deck
    assert translate.steps_of({"stop": {"time": "1 ms"}}, 1e-5) == 100


def test_friction_is_translated_by_the_rules_of_our_laws():
    assert translate.friction({"friction_coefficient": 0.8}) == 0.8
    assert translate.friction_angle({"friction_coefficient": 0.8}) == math.atan(0.8)
    # An angle keeps its bits; not all of these come back from their tangents.
    angles = [0.01 * k for k in range(1, 150)]
    assert [translate.friction_angle({"friction_angle": angle}) for angle in angles] == angles
    named = (("rough", 0.8), ("smooth", 0.3))
    spheres = [{"name": n, "hertz_mindlin": {"young": 1e7, "poisson": 0.2, "friction_coefficient": f}} for n, f in named]
    springs = [{"name": n, "frictional": {"normal_stiffness": 2, "shear_stiffness": 1, "friction_coefficient": f}} for n, f in named]
    for translated in (liggghts._hertz_mindlin({"material": spheres}), liggghts._frictional({"material": springs})):
        assert "coefficientFriction peratomtypepair 2 0.8 0.3 0.3 0.3" in translated[1]


def test_a_missing_library_is_said_with_its_remedy(tmp_path, monkeypatch):
    need("concordem", "liggghts")
    monkeypatch.setenv(liggghts.VARIABLE, str(tmp_path / "none"))
    case = cases.load("cpm-bond").only(["compression"], ["liggghts"])
    round_ = runner.Runner(tmp_path, quiet=True).run([case])
    outcome = round_.outcomes["cpm-bond", "compression", "liggghts"]
    assert outcome.status == "missing" and "make liggghts" in outcome.message and round_.failed(strict=True)


def test_command_line(tmp_path, capsys):
    assert cli.main(["list", "--checks"]) == 0
    assert "cpm-bond" in capsys.readouterr().out
    assert cli.main(["run", "no-such-case", "--output", str(tmp_path)]) == 2
    need("concordem")
    assert cli.main(["run", "lattice-elasticity", "--output", str(tmp_path)]) == 0
    assert (tmp_path / "report.html").exists()
    assert cli.main(["compare", str(tmp_path / "none.h5"), str(tmp_path / "none.h5")]) == 2


def test_the_smoother_surface_slides_first_in_liggghts():
    """As in ConcorDEM and YADE; the mean would be another contact wherever two materials meet."""
    for law, keys in (("hertz_mindlin", dict(young=1e9, poisson=0.2)), ("frictional", dict(normal_stiffness=1e5, shear_stiffness=1e5))):
        document = {"material": [{"name": str(mu), law: {**keys, "friction_coefficient": mu}} for mu in (0.3, 0.1)]}
        properties = liggghts._MODELS[law](document)[1]
        assert "coefficientFriction peratomtypepair 2 0.3 0.1 0.1 0.1" in properties, properties
