"""ConcorDEM: runs the program, reads its result, and exports the start state for the peers."""
import copy
import json
import os
import shutil
from pathlib import Path

import h5py
import numpy as np

from .. import process, programs, scenario, selfcheck
from ..errors import Crashed, HarnessError, NotInstalled
from ..result import Result
from ..start import Start

NAME = "concordem"
NEEDS_START = False
VARIABLE = "CONCORDEM"
_DEFAULT = Path(__file__).parents[3] / "target" / "release" / "concordem"


def program():
    """The program that the variable names; else the one that was built here, or the one in PATH."""
    wanted = os.environ.get(VARIABLE) or (_DEFAULT if _DEFAULT.is_file() else NAME)
    path = Path(wanted)
    if path.is_file():
        return path.resolve()
    found = shutil.which(str(path))
    if not found:
        raise NotInstalled(f"ConcorDEM is not installed ({wanted} is missing); run pip install concordem, in its sources cargo build "
                           f"--release -p concordem, or set {VARIABLE} to the program")
    return Path(found).resolve()


def version():
    """Hash of the program and of what it loads, so that a rebuilt program counts as another engine."""
    return f"concordem sha256 {programs.identity(program())}"


def _prepare(task, folder, changes=None):
    document = scenario.changed(task.scenario, changes or {})
    # files of the case, such as packings and meshes, have paths relative to it
    document = _absolute(document, task.folder)
    path = folder / "scenario.toml"
    path.write_text(scenario.dumps(document))
    return path


def _absolute(value, folder, key=None):
    """A scenario with absolute paths to the files that it names."""
    if isinstance(value, dict):
        return {name: _absolute(item, folder, name) for name, item in value.items()}
    if isinstance(value, list):
        return [_absolute(item, folder, key) for item in value]
    is_path = isinstance(value, str) and key in ("path", "file", "mesh", "stl") and (folder / value).is_file()
    return str((folder / value).resolve()) if is_path else value


def _run(folder, limit, threads, output="result.h5", options=()):
    return process.run([program(), "run", "--force", "--quiet", "-j", threads, "-o", output, *options, "scenario.toml"], folder, limit)


def _elastic(task, folder, limit):
    """Elastic constants from the program's command `elastic`, which has no run and no series."""
    _prepare(task, folder)
    text, wall = process.run(
        [program(), "elastic", "--json", "--quiet", "-j", 1, "scenario.toml"], folder, limit)
    result = Result(NAME, 1.0, provenance={"command": "concordem elastic --json -j 1 scenario.toml"})
    result.numbers.update(elastic=json.loads(text), wall_s=wall)
    return result


def package():
    """Our Python package, whose operators accept any arrays."""
    try:
        import concordem
        import concordem.operators
    except ImportError as error:
        raise NotInstalled(f"the Python package concordem is missing ({error}); run rust-core/python/test.sh package") from None
    return concordem


def also(task):
    """Additional inputs of a run: hash of the package, if its operators are used."""
    if task.command != "operators":
        return ""
    return programs.digest_all([Path(package().__file__).parent])


def _operators(task):
    """Our operators on the final state of a peer."""
    operators = package().operators
    state = {name.removeprefix("frozen/"): values for name, (values, _) in task.frozen.fields.items() if name.startswith("frozen/")}
    how = task.frozen.numbers["frozen"]
    vectors = lambda name: state[name].reshape(-1, 3)
    contacts = operators.Contacts(
        pair=state["pair"].reshape(-1, 2).astype(np.uint32), branch=vectors("branch"), point=vectors("point"), force=vectors("force"))
    loads = None
    if "wall_particle" in state:
        loads = operators.Loads(
            particle=state["wall_particle"].astype(np.uint32), point=vectors("wall_point"), force=vectors("wall_force"))
    volumes = operators.particle_volumes(state["radius"])
    each = np.asarray(operators.particle_stress(state["position"], contacts, volumes, loads, partition=how["partition"]))
    # branch vectors across the border of the cell count fully, like all others
    found = operators.region_stress(state["position"], contacts, operators.Region.all(how["volume"]))
    each, whole = each.reshape(-1, 9), np.asarray(found.stress).reshape(9)
    if not how["full"]:
        upper = [0, 4, 8, 1, 2, 5]
        each, whole = each[:, upper], whole[upper]
    result = Result(NAME, task.frozen.dt, provenance={
        "command": "concordem.operators in Python", "state_of": task.peer, "package_sha256": also(task)})
    result.numbers["measures"] = {
        "contacts": found.full, "stress": whole.tolist(), "particle_stress": each.ravel().tolist()}
    return result


def run(task, folder, limit):
    for change in task.plant.get("concordem", []):
        task.scenario = change(copy.deepcopy(task.scenario))
    if task.command == "elastic":
        return _elastic(task, folder, limit)
    if task.command == "operators":
        return _operators(task)
    _prepare(task, folder)
    _, wall = _run(folder, limit, 1)
    result = read(folder / "result.h5", task.scenario)
    one = process.run([program(), "info", "--hash", "result.h5"], folder, 60)[0].strip()
    result.provenance["state_hash"] = one
    if task.check_threads:
        _run(folder, limit, 2)
        two = process.run([program(), "info", "--hash", "result.h5"], folder, 60)[0].strip()
        if one != two:
            raise HarnessError(f"runs with 1 and 2 threads have different final states: {one}, {two}; please report this")
        result.provenance["state_hash_2_threads"] = two
    result.provenance["command"] = "concordem run -j 1 scenario.toml"
    result.numbers["wall_s"] = result.numbers.get("wall_s") or wall
    return result


def run_in_two(task, folder, limit):
    """The run in two parts: the second process knows of the first only what it has stored."""
    _prepare(task, folder)
    half = selfcheck.half_of(task)
    _, before = _run(folder, limit, 1, "first.h5", ("--set", f"stop={{ steps = {half} }}"))
    _, after = _run(folder, limit, 1, "second.h5", ("--from", "first.h5"))
    parts = [read(folder / name, task.scenario) for name in ("first.h5", "second.h5")]
    result = selfcheck.joined(*parts, half)
    # bits of a state: its hash, as of a run in one part
    result.provenance["state_hash"] = process.run([program(), "info", "--hash", "second.h5"], folder, 60)[0].strip()
    result.provenance["command"] = f"concordem run -j 1 --set stop.steps={half}, then concordem run -j 1 --from"
    result.numbers["wall_s"] = before + after
    return result


def read(path, document):
    with h5py.File(path, "r", locking=False) as file:
        provenance = {k: v if isinstance(v, str) else str(v) for k, v in file["provenance"].attrs.items()}
        result = Result(NAME, float(provenance["time_step_s"]), provenance=provenance)
        # velocity Verlet is leapfrog with a first kick of half a step
        result.provenance["velocity_at"] = "half steps"
        samples = file["samples"]
        steps = samples["step"][()]
        for name, data in samples.items():
            if isinstance(data, h5py.Dataset):
                if name not in ("step", "time"):
                    result.add(name, steps, data[()], str(data.attrs["unit"]), str(data.attrs["description"]))
                continue
            for column, values in data.items():
                if column in ("step", "time"):
                    continue
                values_ = values[()]
                if values_.ndim == 2 and values_.shape[1] == 9:
                    values_ = values_.reshape(-1, 3, 3)
                result.add(f"{name}.{column}", data["step"][()], values_, str(values.attrs["unit"]),
                           str(values.attrs["description"]))
        _snapshots(file["VTKHDF"], result)
        particles = file["particles"]
        order = np.argsort(particles["id"][()])
        for name in ("radius", "mass", "damage", "fragment"):
            result.fields[name] = (particles[name][()][order], str(particles[name].attrs["unit"]))
        # what the solver turns particles with, not what follows from masses
        state = file["state/particles"]
        result.fields["inertia"] = (state["inertia"][()][np.argsort(state["id"][()])], "kg*m^2")
        for law, group in (file["contacts"].items() if "contacts" in file else ()):
            for name, data in group.items():
                result.fields[f"contacts/{law}/{name}"] = (data[()], str(data.attrs["unit"]))
        for name in ("step", "id_a", "id_b", "damage", "energy"):
            result.fields[f"events/{name}"] = (file[f"events/{name}"][()], str(file[f"events/{name}"].attrs["unit"]))
    wall = float(provenance.get("wall_time_s", 0))
    steps_done = int(result.series["position"].steps[-1])
    result.numbers.update(
        wall_s=wall, particles=len(order), steps=steps_done,
        particle_steps_per_s=len(order) * steps_done / wall if wall > 0 else None)
    contact_force(result, document)
    return result


def contact_force(result, document):
    """Force of a single contact, from the virial (operator record `contact` over 1 m³).

    With one contact W_ij = l_i f_j, so f_j = l_i W_ij / |l|²; l is the distance of particles 0 and 1.
    """
    if "contact.stress" not in result.series or result.series["position"].values.shape[1] != 2:
        return
    work, positions = result.series["contact.stress"], result.series["position"]
    steps, a, b = np.intersect1d(work.steps, positions.steps, return_indices=True)
    branch = positions.values[b, 1] - positions.values[b, 0]
    force = np.einsum("ni,nij->nj", branch, work.values[a]) / np.einsum("ni,ni->n", branch, branch)[:, None]
    result.add("contact_force", steps, force, "N", "Force of the contact on particle 0")


def _snapshots(vtk, result):
    """Snapshots of all particles, ordered by id."""
    steps = vtk["Steps/step"][()]
    point_offsets = vtk["Steps/PointOffsets"][()]
    count = len(vtk["PointData/id"]) if len(steps) else 0
    ids = vtk["PointData/id"][()]
    order = np.argsort(ids)
    point = vtk["PointData"]
    heat = [("temperature", point["temperature"], vtk["Steps/PointDataOffsets/temperature"][()])] if "temperature" in point else []
    for name, data, offsets in (
        *heat,
        ("position", vtk["Points"], point_offsets),
        ("velocity", vtk["PointData/velocity"], vtk["Steps/PointDataOffsets/velocity"][()]),
        ("angular_velocity", vtk["PointData/angular_velocity"], vtk["Steps/PointDataOffsets/angular_velocity"][()]),
        ("damage_field", vtk["PointData/damage"], vtk["Steps/PointDataOffsets/damage"][()]),
    ):
        values = data[()]
        unit = {"position": "m", "velocity": "m/s", "angular_velocity": "rad/s", "temperature": "K"}.get(name, "1")
        result.add(name, steps, np.array([values[o:o + count][order] for o in offsets]), unit, "All particles")


def export_start(task, folder, limit=120):
    """Run one step and read the state before it; reference lengths are those of the bonds."""
    _prepare(task, folder, {"stop": {"steps": 1}, "output.snapshot_interval": 1, "output.sample_interval": 1})
    try:
        _run(folder, limit, 1)
    except Crashed as error:
        raise HarnessError(f"the scenario cannot be built: {error}") from None
    with h5py.File(folder / "result.h5", "r", locking=False) as file:
        vtk, particles = file["VTKHDF"], file["particles"]
        count = len(vtk["PointData/id"])
        by_id = np.argsort(vtk["PointData/id"][()])
        row = np.argsort(particles["id"][()])
        law = task.scenario.get("bonds", {}).get("law")
        group = file["contacts"].get(law) if law else None
        bonds = group["ids"][()].astype(np.int64) if group else np.zeros((0, 2), np.int64)
        length = group["reference_length"][()] if group else np.zeros(0)
        cell = np.zeros(0)
        if "cell" in file:
            # undo the deformation of the step by its deformation gradient; cells start with edges along the axes
            undone = np.linalg.solve(file["cell/deformation_gradient"][()], file["cell/edges"][()])
            if np.abs(undone - np.diag(np.diag(undone))).max() > 1e-12 * np.abs(undone).max():
                undone = np.linalg.solve(file["cell/deformation_gradient"][()], file["cell/edges"][()].T)
            cell = np.diag(undone).copy()
            if np.abs(undone - np.diag(cell)).max() > 1e-12 * cell.max():
                raise HarnessError("the periodic cell does not start with edges along the axes")
        return Start(
            cell=cell, dt=float(file["provenance"].attrs["time_step_s"]),
            position=vtk["Points"][:count][by_id], velocity=vtk["PointData/velocity"][:count][by_id],
            angular_velocity=vtk["PointData/angular_velocity"][:count][by_id],
            radius=particles["radius"][()][row], mass=particles["mass"][()][row],
            material=particles["material"][()][row].astype(int), bonds=np.sort(bonds, axis=1), reference_length=length)

