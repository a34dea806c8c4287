"""LIGGGHTS 3.8.0 from Debian: translates scenario and start state to a data file and an input script.

Native models: `hertz_mindlin` → `hertz tangential history`, `frictional` with stiffnesses → `hooke/stiffness tangential
history`. The public build has no bonds: bonded laws come by our library (docs/book/reference/liggghts.md), `fix concordem/bond` with the
bonds of the start state. There the law is ours, and the host's are motion, lists, and processors.
"""
import math
import os
import re
import shutil
from pathlib import Path

import numpy as np

from .. import process, programs, scenario, selfcheck
from ..errors import Crashed, NotInstalled, Unsupported
from ..quantity import si, vector
from ..result import Result
from . import liggghts_heat, translate

MPI = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}


def version():
    program = shutil.which("liggghts")
    if not program:
        raise NotInstalled("LIGGGHTS is not installed; run apt install liggghts")
    return programs.label("liggghts", program, "-h", environment=MPI)


VARIABLE = "CONCORDEM_LIGGGHTS"
_LAUNCHER = Path(__file__).parents[3] / "target" / "liggghts" / "concordem-liggghts"


def launcher():
    """Path of the launcher that starts LIGGGHTS with our library."""
    path = Path(os.environ.get(VARIABLE, _LAUNCHER))
    if not path.is_file():
        raise NotInstalled(f"{path} is missing; run make liggghts, or set {VARIABLE} to the launcher")
    return path.resolve()


def _ours(task):
    """Whether our library computes the contacts: always with bonds, else for contact laws without a native model."""
    return "bonds" in task.scenario or task.scenario["contacts"]["law"] not in {*_MODELS, "none"}


def also(task):
    """Additional inputs of a run: hash of our library, if it is used."""
    if not _ours(task):
        return ""
    return programs.identity(launcher(), [launcher().with_name("libconcordem-liggghts.so")])


def _number(value):
    return repr(float(value))


def _pairs(function, materials):
    """A property of pairs of materials, in row-major order."""
    return " ".join(_number(function(a, b)) for a in materials for b in materials)


def _smoother(a, b):
    """The friction coefficient of the smoother of two surfaces, which slides first, as in ConcorDEM and YADE."""
    return min(translate.friction(a), translate.friction(b))


def _hertz_mindlin(document):
    laws = [m["hertz_mindlin"] for m in document["material"]]
    for law in laws:
        translate.law_keys("liggghts", law, {"young", "poisson", "friction_coefficient", "restitution"})
    lines = ["hard_particles yes"] if max(si(m["young"]) for m in laws) > 1e9 else []
    lines.append("soft_particles yes" if min(si(m["young"]) for m in laws) < 5e6 else "")
    pairs = translate.hertz_pairs(document)
    of = lambda which: lambda a, b: pairs[min(a, b), max(a, b)][which]
    properties = [
        "youngsModulus peratomtype " + " ".join(_number(si(m["young"])) for m in laws),
        "poissonsRatio peratomtype " + " ".join(_number(si(m["poisson"])) for m in laws),
        f"coefficientRestitution peratomtypepair {len(laws)} " + _pairs(of(1), range(len(laws))),
        f"coefficientFriction peratomtypepair {len(laws)} " + _pairs(of(0), range(len(laws))),
    ]
    # no tangential dashpot in our law
    return lines, properties, "model hertz tangential history"


def _frictional(document):
    laws = [m["frictional"] for m in document["material"]]
    for law in laws:
        translate.law_keys("liggghts", law, {
            "young", "stiffness_ratio", "normal_stiffness", "shear_stiffness", "friction_coefficient", "damping_ratio"})
    if any("normal_stiffness" not in m or si(m.get("damping_ratio", 0)) for m in laws):
        raise Unsupported("liggghts: linear contacts need both stiffnesses and no dashpots")
    # as in ConcorDEM, the contact has the mean stiffness of both materials, N/m
    mean = lambda key: lambda a, b: 0.5 * (si(a[key]) + si(b[key]))
    zero = lambda a, b: 0.0
    n = len(laws)
    properties = [
        f"kn peratomtypepair {n} " + _pairs(mean("normal_stiffness"), laws),
        f"kt peratomtypepair {n} " + _pairs(mean("shear_stiffness"), laws),
        f"gamman peratomtypepair {n} " + _pairs(zero, laws),
        f"gammat peratomtypepair {n} " + _pairs(zero, laws),
        f"coefficientFriction peratomtypepair {n} "
        + _pairs(_smoother, laws),
    ]
    return [], properties, "model hooke/stiffness tangential history"


_MODELS = {"hertz_mindlin": _hertz_mindlin, "frictional": _frictional}


def _materials(document):
    """Tables of parameters for our library."""
    return scenario.dumps({"material": document["material"]})


def _bond_fix(document):
    """The line of our fix; parameters and bonds are in separate files."""
    bonds = f"{document['bonds']['law']} bond list bonds.txt" if "bonds" in document else "none"
    line = f"fix bonds all concordem/bond {bonds} materials materials.toml"
    line += f" kinematics {document.get('kinematics', 'finite')} contact {document['contacts']['law']}"
    if document.get("loading", {}).get("kind") == "platens":
        # the pairs that `_plates` excludes are ours
        line += " exclude ignore"
    if "heat" in document:
        line += " heat heat.toml"
    if "deformable" in document:
        translate.law_keys("liggghts", document["deformable"], {"condition"})
        line += f" deformable {document['deformable'].get('condition', 'solid')}"
    return line


def _groups(fixed):
    """Names and ids of particles with the same fixed components."""
    found = {}
    for p, letters in enumerate(fixed):
        if letters:
            found.setdefault("".join(sorted(letters)), []).append(p)
    return found


def group_lines(name, members):
    """Lines that define a group. Several, because the length of a line is limited; repeating a group extends it."""
    ids = [str(p + 1) for p in members]
    return [f"group {name} id " + " ".join(ids[k:k + 50]) for k in range(0, len(ids), 50)]


def _held(fixed, loading):
    """Groups whose motion is prescribed: forces along fixed components are set to zero, so that velocities stay.

    `fix setforce` sums what it takes away, which is the reaction. Spins are held by `fix nve`, which leaves them alone.
    """
    lines, still = [], []
    groups = {}
    if loading:
        axis, low, high, _ = loading
        ends = {int(p): name for name, members in (("low", low), ("high", high)) for p in members}
        for letters, members in _groups(fixed).items():
            for p in members:
                groups.setdefault((ends.get(p, ""), letters), []).append(p)
    else:
        for letters, members in _groups(fixed).items():
            for p in members:
                # separate groups, to get the reaction of each particle of a pair
                groups.setdefault((str(p) if len(fixed) == 2 else "", letters), []).append(p)
    for k, ((name, letters), members) in enumerate(groups.items()):
        if 0 < sum(c in letters for c in "XYZ") < 3:
            raise Unsupported("liggghts: rotations must be fixed about all axes or none")
        group = name if name in ("low", "high") else f"held{name or k}"
        lines += group_lines(group, members)
        force = " ".join("0.0" if c in letters else "NULL" for c in "xyz")
        lines.append(f"fix {group} {group} setforce {force}")
        if "X" in letters:
            still += members
    free = "all"
    if still:
        lines += [*group_lines("still", still), "group turning subtract all still"]
        free = "turning"
    # groups first; the fixes must follow the fix that computes the forces
    return lines, [f"fix integrate {free} nve/sphere"] + (["fix integrate_still still nve"] if still else [])


def _plates(document, start):
    """Two plates as meshes that LIGGGHTS moves, and its own linear contact with them: lines, properties, and STL files.

    Our fix computes the contacts of spheres, so these are excluded from the neighbor list of LIGGGHTS' pair style, which the walls need.
    """
    if document["contacts"]["law"] != "frictional":
        raise Unsupported("liggghts: plates need linear contacts (frictional)")
    _, properties, style = _frictional(document)
    plates = translate.platens(document, start)[0]
    lines, files = [], {}
    kinds = " ".join(str(k + 1) for k in range(len(document["material"])))
    lines += [f"pair_style gran {style} tangential_damping off", "pair_coeff * *"]
    lines += [f"neigh_modify exclude type {a} {b}" for a in kinds.split() for b in kinds.split() if a <= b]
    for name, (axis, position, side, speed, material) in zip(("lower", "upper"), plates, strict=True):
        # a rectangle ten radii larger than the specimen, within the box of the run; two triangles
        corners = np.full((4, 3), position)
        others = [k for k in range(3) if k != axis]
        low, high = start.position.min(axis=0)[others], start.position.max(axis=0)[others]
        half = 0.5 * (high - low) + 10 * start.radius.max()
        corners[:, others] = 0.5 * (low + high) + half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        files[f"{name}.stl"] = translate.stl(corners, ((0, 1, 2), (0, 2, 3)))
        lines += [f"fix {name} all mesh/surface/stress file {name}.stl type {material + 1}",
                  f"fix move_{name} all move/mesh mesh {name} linear " + " ".join(map(_number, speed))]
    lines.append(f"fix plates all wall/gran {style} mesh n_meshes 2 meshes lower upper tangential_damping off")
    return lines, properties, files, [f"f_{name}[{plates[0][0] + 1}]" for name in ("lower", "upper")]


def _meshes(document, style):
    """Meshes that stand or turn: lines and STL files."""
    lines, files, names = [], {}, []
    for k, (vertices, triangles, material, center, spin) in enumerate(translate.meshes(document)):
        files[f"mesh{k}.stl"] = translate.stl(vertices, triangles)
        names.append(f"mesh{k}")
        lines.append(f"fix mesh{k} all mesh/surface file mesh{k}.stl type {material + 1}")
        speed = float(np.linalg.norm(spin))
        if speed:
            lines.append(f"fix turn{k} all move/mesh mesh mesh{k} rotate origin {' '.join(map(_number, center))} "
                         f"axis {' '.join(map(_number, spin / speed))} period {_number(2 * math.pi / speed)}")
    if names:
        lines.append(f"fix meshes all wall/gran {style} mesh n_meshes {len(names)} meshes {' '.join(names)} tangential_damping off")
    return lines, files


def deck(task, ranks):
    """Files of the run by name, and the number of steps."""
    document, start = task.scenario, task.start
    ours = _ours(task)
    native = {"history", "interface"} if document["contacts"]["law"] == "hertz_mindlin" and not ours else set()
    translate.check_keys({k: v for k, v in document.items() if not (ours and k == "deformable")}, "liggghts", known={"heat"} | native)
    if translate.local_damping(document):
        raise Unsupported("liggghts: it has no local damping")
    law = document["contacts"]["law"]
    loading, plates = None, None
    fixed, velocity, spin = translate.prescribed(document, start)
    if document.get("loading", {}).get("kind", "none") == "uniaxial":
        loading = translate.end_layers(document, start)
        letters = "xyz"[loading[0]] if document["loading"].get("lateral", "free") == "free" else "xyzXYZ"
        for p in (*loading[1], *loading[2]):
            fixed[p] |= set(letters)
    elif document.get("loading", {}).get("kind") == "platens" and ours:
        plates = _plates(document, start)
    elif document.get("loading", {}).get("kind", "none") != "none":
        raise Unsupported(f"liggghts: no translation of loading {document['loading']['kind']}")
    force, moment = translate.forces(document, start)
    if moment.any():
        raise Unsupported("liggghts: no translation of moments on particles")
    if ours:
        if document.get("wall"):
            raise Unsupported("liggghts: our bonds do not support walls")
        head, properties, style = [], plates[1] if plates else [], None
    elif "heat" in document:
        head, properties, style = [], [], liggghts_heat.STYLE
        if liggghts_heat.moves(document):
            head, properties, style = _MODELS[law](document)
        properties = properties + liggghts_heat.properties(document, start)
    elif law in _MODELS:
        head, properties, style = _MODELS[law](document)
    else:
        raise Unsupported(f"liggghts: no native model of `{law}`")
    steps = translate.steps_of(document, start.dt)
    output = document.get("output", {})
    interval = output.get("snapshot_interval") or steps
    extent = 20 * start.radius.max()
    gravity = vector(document.get("integration", {}).get("gravity", [0, 0, 0]))
    size = math.sqrt(sum(g * g for g in gravity))
    duration = steps * start.dt
    travel = np.abs(velocity).max() * duration
    low, high = start.position.min(axis=0) - extent - travel, start.position.max(axis=0) + extent + travel
    # all particles must stay in the box
    fall = 0.5 * np.array(gravity) * duration**2 * np.array([not any(w[0] == k for w in translate.planes(document)) for k in range(3)])
    low, high = low + np.minimum(fall, 0), high + np.maximum(fall, 0)
    # horizontal speeds are at most the speed of a fall through the height of the start state
    for axis in range(3):
        if size and not gravity[axis] and not sum(w[0] == axis for w in translate.planes(document)) > 1:
            along = int(np.argmax(np.abs(gravity)))
            away = math.sqrt(2 * size * (np.ptp(start.position[:, along]) + extent)) * duration
            low[axis], high[axis] = low[axis] - away, high[axis] + away
    for axis, position, *_ in translate.planes(document):
        low[axis], high[axis] = min(low[axis], position - extent), max(high[axis], position + extent)
    mesh_lines, mesh_files = _meshes(document, style) if style else ([], {})
    for vertices, _, _, center, _ in translate.meshes(document) if mesh_files else ():
        # a turning mesh stays in a ball about its center
        reach = np.linalg.norm(vertices - center, axis=1).max() + extent
        low, high = np.minimum(low, center - reach), np.maximum(high, center + reach)
    data = ["LIGGGHTS data file of a start state", "", f"{len(start.radius)} atoms", "",
            f"{len(document['material'])} atom types", ""]
    data += [f"{_number(low[k])} {_number(high[k])} {c}lo {c}hi" for k, c in enumerate("xyz")]
    data += ["", "Atoms", ""]
    for p, (x, r, m) in enumerate(zip(start.position, start.radius, start.mass)):
        density = m / (4 / 3 * math.pi * r**3)
        data.append(" ".join([str(p + 1), str(start.material[p] + 1), _number(2 * r), _number(density), *map(_number, x)]))
    data += ["", "Velocities", ""]
    for p in range(len(start.radius)):
        data.append(" ".join([str(p + 1), *map(_number, velocity[p]), *map(_number, spin[p])]))
    skin = start.radius.min() * 0.5
    lines = [
        f"atom_style {'sphere' if ours and not plates else 'granular'}", "atom_modify map array sort 0 0.0", "boundary f f f",
        "newton off", "communicate single vel yes", "units si", *filter(None, head),
        "read_data data.txt", f"neighbor {_number(skin)} bin", "neigh_modify delay 0",
        *[f"fix property{k} all property/global {p}" for k, p in enumerate(properties)],
        f"timestep {_number(start.dt)}",
    ]
    if style:
        lines += [f"pair_style gran {style} tangential_damping off", "pair_coeff * *"]
    lines += plates[0] if plates else []
    for k, (axis, position, _, speed, material) in enumerate(translate.planes(document)):
        if any(speed):
            raise Unsupported("liggghts: no translation of moving walls")
        lines.append(f"fix wall{k} all wall/gran {style} primitive type {material + 1} "
                     f"{'xyz'[axis]}plane {_number(position)} tangential_damping off")
    lines += mesh_lines
    if size:
        lines.append(f"fix gravity all gravity {_number(size)} vector " + " ".join(map(_number, gravity)))
    if ours:
        lines += liggghts_heat.groups_of_bonds(document, start, group_lines)
        lines.append(_bond_fix(document))
    for p in np.flatnonzero(force.any(axis=1)):
        lines += [f"group loaded{p} id {p + 1}", f"fix load{p} loaded{p} addforce " + " ".join(map(_number, force[p]))]
    held, integrators = _held(fixed, loading)
    columns = "id x y z vx vy vz omegax omegay omegaz fx fy fz radius mass"
    if "heat" in document and ours:
        columns += " f_bonds"
    elif "heat" in document:
        lines += liggghts_heat.lines(document, start, group_lines)
        columns += " f_Temp[0]"
        if not liggghts_heat.moves(document):
            held, integrators = [], []
    lines += [
        *held, *integrators, f"dump all all custom {interval} dump.txt {columns}",
        'dump_modify all sort id format "%d' + " %.17g" * (len(columns.split()) - 1) + '"']
    reactions = []
    if loading:
        reactions = [f"f_{end}[{loading[0] + 1}]" for end in ("low", "high")]
    elif len(start.radius) == 2 and fixed[0]:
        reactions = [f"f_held0[{k}]" for k in (1, 2, 3)]
    elif plates:
        reactions = plates[3]
    if reactions:
        lines += ["thermo_style custom step " + " ".join(reactions), "thermo_modify format float %.17g lost error",
                  f"thermo {output.get('sample_interval', 10)}"]
    else:
        lines.append("thermo 1000000")
    if task.command == "operators":
        if ours:
            raise Unsupported("liggghts: our bonds are not in its pair virial")
        lines += [
            "compute each all stress/atom pair", "compute contacts all pair/gran/local id force contactPoint",
            "compute heat all temp", "compute whole all pressure heat pair",
            f"dump each all custom {steps} each.txt id c_each[1] c_each[2] c_each[3] c_each[4] c_each[5] c_each[6]",
            'dump_modify each sort id format "%d' + " %.17g" * 6 + '"',
            f"dump contacts all local {steps} contacts.txt " + " ".join(f"c_contacts[{k + 1}]" for k in range(9)),
            'dump_modify contacts format "' + " ".join(["%.17g"] * 9) + '"',
            "thermo_style custom step vol " + " ".join(f"c_whole[{k + 1}]" for k in range(6)),
            "thermo_modify format float %.17g lost error", f"thermo {steps}"]
    lines.append(f"run {steps}")
    files = {"data.txt": "\n".join(data) + "\n", "in.txt": "\n".join(lines) + "\n"}
    files |= mesh_files | (plates[2] if plates else {})
    if ours:
        files["materials.toml"] = _materials(document)
        if "heat" in document:
            files["heat.toml"] = scenario.dumps({"heat": document["heat"]})
        # with heat, the start state has the lengths of its temperatures; at bonding, they are the distances
        lengths = start.reference_length if "heat" not in document else [""] * len(start.bonds)
        files["bonds.txt"] = "".join(
            f"{a + 1} {b + 1} {length and _number(length)}\n" for (a, b), length in zip(start.bonds, lengths))
    return files, steps


def _frozen(result, task, folder, text, position):
    """The state of the last step for our operators, and the results of LIGGGHTS' operators.

    `stress/atom` gives half of Σ branch ⊗ force to each atom of a contact, times no volume, above the diagonal only; the first index
    is that of the place, as ours. Pressure has the opposite sign. Walls are in neither.
    """
    r = task.start.radius
    rows = _local(folder / "contacts.txt", 9)
    pair = rows[:, :2].astype(int) - 1
    result.fields.update({
        "frozen/position": (position, "m"), "frozen/radius": (r, "m"), "frozen/pair": (pair, "1"), "frozen/point": (rows[:, 6:9], "m"),
        "frozen/branch": (position[pair[:, 1]] - position[pair[:, 0]], "m"), "frozen/force": (rows[:, 3:6], "N")})
    _, virial = dump_of(folder / "each.txt", len(r))
    _, thermo = _thermo(text, 7)
    result.numbers["frozen"] = {"partition": "half-branch", "volume": float(thermo[-1, 0]), "full": False}
    each = virial[-1] / (4 / 3 * math.pi * r**3)[:, None]
    result.numbers["measures"] = {"contacts": len(pair), "stress": (-thermo[-1, 1:]).tolist(), "particle_stress": each.ravel().tolist()}


def _local(path, columns):
    """Rows of the last snapshot of a local dump."""
    rows = []
    with open(path) as file:
        for line in file:
            if line.startswith("ITEM: ENTRIES"):
                rows = []
            elif not line.startswith("ITEM:") and len(line.split()) == columns:
                rows.append([float(word) for word in line.split()])
    return np.array(rows).reshape(-1, columns)


def _thermo(text, columns):
    """Steps and numbers of the thermo output."""
    rows = []
    inside = False
    for line in text.splitlines():
        words = line.split()
        if words[:1] == ["Step"]:
            inside = True
        elif inside and len(words) == columns + 1 and words[0].isdigit():
            rows.append([float(word) for word in words])
        elif words[:2] == ["Loop", "time"]:
            inside = False
    # the last step is printed twice if it is not a multiple of the interval
    table = np.array(rows).reshape(-1, columns + 1)
    return table[:, 0].astype(int), table[:, 1:]


def dump_of(path, count, who="LIGGGHTS"):
    """Steps and columns of a text dump."""
    steps, frames = [], []
    with open(path) as file:
        for line in file:
            if line.startswith("ITEM: TIMESTEP"):
                steps.append(int(next(file)))
            elif line.startswith("ITEM: NUMBER"):
                there = int(next(file))
                if there != count:
                    raise Crashed(f"{who} has lost {count - there} of {count} particles by step {steps[-1]}: they left the box; enlarge it")
            elif line.startswith("ITEM: ATOMS"):
                rows = np.array([[float(v) for v in next(file).split()] for _ in range(count)])
                frames.append(rows[np.argsort(rows[:, 0]), 1:])
    return np.array(steps), np.array(frames)


_HALF = "half.restart"


class Liggghts:
    """LIGGGHTS on a number of ranks."""

    def __init__(self, name, ranks):
        self.NAME, self.ranks = name, ranks

    version = staticmethod(version)

    also = staticmethod(also)

    def run(self, task, folder, limit):
        return self._once(task, folder, limit, lambda text, steps: (text, steps))

    def run_in_two(self, task, folder, limit):
        """Half of the run, then the rest by another process from the restart file that the first has written."""
        if _ours(task) or "heat" in task.scenario or translate.meshes(task.scenario):
            raise Unsupported("liggghts: only its own contact models without heat and meshes are continued here")
        half = selfcheck.half_of(task)
        places = [folder / name for name in ("first", "second")]
        for place in places:
            place.mkdir()
        before = self._once(task, places[0], limit, lambda text, steps: (
            text.replace(f"run {steps}\n", f"run {half}\nwrite_restart {_HALF}\n"), half))
        (places[0] / _HALF).rename(places[1] / _HALF)
        after = self._once(task, places[1], limit, lambda text, steps: (
            text.replace("read_data data.txt", f"read_restart {_HALF}").replace(f"run {steps}\n", f"run {steps} upto\n"), steps))
        return selfcheck.joined(before, after, half)

    def _once(self, task, folder, limit, part):
        """A run; `part` gets its input script and number of steps, and gives those of a part of it."""
        files, steps = deck(task, self.ranks)
        files["in.txt"], steps = part(files["in.txt"], steps)
        for change in task.plant.get("liggghts", []):
            files["in.txt"] = change(files["in.txt"])
        for name, text in files.items():
            (folder / name).write_text(text)
        # `-screen none` crashes this version (quirk liggghts-screen-none)
        program = [launcher(), "in.txt"] if _ours(task) else ["liggghts", "-in", "in.txt"]
        command = [*map(str, program), "-log", "log.liggghts"]
        if self.ranks > 1:
            # ranks that wait spin: on Linux from 6.18 on a rank that yields loses a time slice, in each step, to all other work
            command = ["mpirun", "-np", str(self.ranks), "--oversubscribe", "--bind-to", "none", *command]
        text, wall = process.run(command, folder, limit, {**process.ONE_THREAD, **MPI})
        if not (folder / "dump.txt").exists():
            raise Crashed("LIGGGHTS ended without a dump (see log.txt)")
        count = len(task.start.radius)
        at, frames = dump_of(folder / "dump.txt", count)
        if len(at) == 0 or at[-1] < steps - steps % max(1, at[1] - at[0] if len(at) > 1 else 1):
            raise Crashed("LIGGGHTS ended before the last step (see log.txt)")
        result = Result(self.NAME, task.start.dt)
        for name, unit, columns in (("position", "m", slice(0, 3)), ("velocity", "m/s", slice(3, 6)),
                                    ("angular_velocity", "rad/s", slice(6, 9))):
            result.add(name, at, frames[:, :, columns], unit, "All particles")
        if "heat" in task.scenario:
            # the flow of a step has the positions at its end, ours those at its start; at first no grains touch
            late = int(liggghts_heat.moves(task.scenario) and not _ours(task))
            result.add("temperature", at + late, frames[:, :, 14], "K", "All particles")
        if task.command == "operators":
            _frozen(result, task, folder, text, frames[-1, :, :3])
        fixed = translate.prescribed(task.scenario, task.start)[0]
        if task.scenario.get("loading", {}).get("kind", "none") == "uniaxial":
            samples, reaction = _thermo(text, 2)
            area = si(task.scenario["loading"]["area"])
            result.add("stress", samples, 0.5 * (reaction[:, 0] - reaction[:, 1]) / area, "Pa")
        elif task.scenario.get("loading", {}).get("kind") == "platens":
            samples, reaction = _thermo(text, 2)
            _, area, sign, length = translate.platens(task.scenario, task.start)
            closing = si(task.scenario["loading"]["closing_velocity"])
            result.add("strain", samples, -closing * samples * task.start.dt / length, "1")
            result.add("stress", samples, sign * 0.5 * (reaction[:, 0] - reaction[:, 1]) / area, "Pa")
        if count == 2 and fixed[0]:
            samples, reaction = _thermo(text, 3)
            result.add("contact_force", samples, reaction, "N", "Force of the contact on particle 0")
        elif count == 2 and not task.scenario.get("wall") and not task.scenario.get("integration", {}).get("gravity"):
            result.add("contact_force", at, frames[:, 0, 9:12], "N", "Force of the contact on particle 0")
        result.fields["radius"], result.fields["mass"] = (frames[0, :, 12], "m"), (frames[0, :, 13], "kg")
        loop = re.search(r"Loop time of ([\d.eE+-]+)", text)
        wall = float(loop[1]) if loop else wall
        result.numbers.update(wall_s=wall, particles=count, steps=steps,
                              particle_steps_per_s=count * steps / wall if wall else None)
        result.provenance.update(version=version(), command=" ".join(command).replace(str(launcher().parent) + "/", "") if _ours(task) else " ".join(command),
                                 velocity_at="full steps",
                                 ranks=str(self.ranks))
        return result


ONE, TWO = Liggghts("liggghts", 1), Liggghts("liggghts-np2", 2)
