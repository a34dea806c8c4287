"""YADE from Debian: translates scenario and start state to a task for `yade_driver.py`, run headless on one thread."""
import json
import math
import re
import shutil
from pathlib import Path

import numpy as np

from .. import process, programs, selfcheck
from ..errors import Crashed, NotInstalled, Unsupported
from ..quantity import si, vector
from ..result import Result
from . import translate

NAME = "yade"
# read once, so that an edit during a long round has no effect
_DRIVER = Path(__file__).with_name("yade_driver.py").read_text()
_DAMAGE_LAWS = {"linear": 0, "exponential": 1}


def version():
    program = shutil.which("yade")
    if not program:
        raise NotInstalled("YADE is not installed; run apt install yade")
    return programs.label(NAME, program, "--version", _libraries(program))


def _libraries(program):
    """The folder of compiled libraries above the folder of Python modules that the start script names."""
    text = Path(program).read_text(errors="replace")
    found = [Path(p) for p in re.findall(r"sys\.path\.insert\(1,'([^']+)/py'\)", text)]
    return [p for p in found if p.is_dir()]


def _cpm(material, document, start):
    law = material["cpm"]
    if law.get("mode") == "woo":
        raise Unsupported("yade: no translation of CPM in mode woo")
    translate.law_keys("yade", law, {
        "young", "shear_ratio", "crack_onset_strain", "relative_ductility", "cohesion", "friction_angle",
        "friction_coefficient", "mode", "damage_law", "omega_threshold", "never_damage", "soft_strain",
        "relative_soft_stiffness", "isotropic_prestress", "shear_contribution"})
    return dict(
        kind="cpm", young=si(law["young"]), poisson=si(law["shear_ratio"]), sigmaT=si(law["cohesion"]),
        epsCrackOnset=si(law["crack_onset_strain"]), relDuctility=si(law["relative_ductility"]),
        frictionAngle=translate.friction_angle(law), density=si(material["density"]),
        damLaw=_DAMAGE_LAWS[law.get("damage_law", "exponential")], neverDamage=law.get("never_damage", False),
        equivStrainShearContrib=si(law.get("shear_contribution", 0)), isoPrestress=si(law.get("isotropic_prestress", 0)),
        functor=dict(
            omegaThreshold=si(law.get("omega_threshold", 1)), epsSoft=si(law.get("soft_strain", 1)),
            relKnSoft=si(law.get("relative_soft_stiffness", 0.3))))


def _frictional(material, document, start):
    """YADE's k_n = 2 E_A r_A E_B r_B/(E_A r_A + E_B r_B), which is E r for equal spheres; gives the modulus of a given stiffness."""
    law = material["frictional"]
    translate.law_keys("yade", law, {
        "young", "stiffness_ratio", "normal_stiffness", "shear_stiffness", "friction_coefficient", "damping_ratio"})
    if si(law.get("damping_ratio", 0)):
        raise Unsupported("yade: linear contacts must have no dashpots")
    if "young" in law:
        young, ratio = si(law["young"]), si(law["stiffness_ratio"])
    elif np.ptp(start.radius) == 0 and len(document["material"]) == 1:
        young = si(law["normal_stiffness"]) / float(start.radius[0])
        ratio = si(law["shear_stiffness"]) / si(law["normal_stiffness"])
    else:
        raise Unsupported("yade: given stiffnesses need one material and equal spheres; else use `young` and `stiffness_ratio`")
    return dict(kind="frictional", young=young, poisson=ratio, frictionAngle=translate.friction_angle(law),
                density=si(material["density"]))


def _hertz_mindlin(material, document, start):
    law = material["hertz_mindlin"]
    translate.law_keys("yade", law, {"young", "poisson", "friction_coefficient", "restitution"})
    return dict(kind="hertz_mindlin", young=si(law["young"]), poisson=si(law["poisson"]),
                frictionAngle=translate.friction_angle(law), density=si(material["density"]),
                restitution=si(law.get("restitution", 1)))


def _cohesive_beam(material, document, start):
    """YADE's moment law with the stiffnesses of the beam, for equal spheres with reference length L = 2r.

    YADE's are k_n = E' r, k_s = P k_n, k_r = r² k_s α_r, k_t = r² k_s α_t for the material (E', P, α_r, α_t); the beam's
    EA/L, 12EI/L³, EI/L, GJ/L. A beam that bends by 12EI/L³ about its middle and EI/L is Euler-Bernoulli's.
    """
    law = material["cohesive_beam"]
    if law.get("model", "euler-bernoulli") != "euler-bernoulli" or "radius" not in law:
        raise Unsupported("yade: beams must be euler-bernoulli, with `radius`")
    translate.law_keys("yade", law, {"young", "poisson", "radius", "model"})
    if np.ptp(start.radius) > 0 or len(document["material"]) > 1:
        raise Unsupported("yade: beams need equal spheres of one material")
    return dict(kind="cohesive_beam", young=si(law["young"]), poisson=si(law.get("poisson", 0.3)),
                beam_radius=si(law["radius"]), density=si(material["density"]))


def _linear_bond(material, document, start):
    """YADE's cohesive contact without moments: k_n = E' r, k_s = P k_n of equal spheres, strength r² times the cohesion."""
    law = material["linear_bond"]
    translate.law_keys("yade", law, {"normal_stiffness", "shear_stiffness", "normal_strength"})
    if np.ptp(start.radius) > 0 or len(document["material"]) > 1:
        raise Unsupported("yade: linear bonds need equal spheres of one material")
    normal, shear = si(law["normal_stiffness"]), si(law["shear_stiffness"])
    if np.any(np.abs(start.reference_length - 2 * start.radius[0]) > 1e-9 * start.radius[0]):
        raise Unsupported("yade: linear bonds need touching spheres")
    friction = 0.0
    if document["contacts"]["law"] == "frictional":
        contact = material["frictional"]
        translate.law_keys("yade", contact, {"normal_stiffness", "shear_stiffness", "friction_coefficient"})
        if (si(contact["normal_stiffness"]), si(contact["shear_stiffness"])) != (normal, shear):
            raise Unsupported("yade: contacts must have the stiffnesses of the bonds")
        friction = translate.friction(contact)
    return dict(kind="linear_bond", young=normal / float(start.radius[0]), poisson=shear / normal,
                normalCohesion=si(law["normal_strength"]) / float(start.radius[0]) ** 2 if "normal_strength" in law else 1e30,
                frictionAngle=math.atan(friction), density=si(material["density"]))


_LAWS = {"cpm": _cpm, "frictional": _frictional, "hertz_mindlin": _hertz_mindlin, "cohesive_beam": _cohesive_beam,
         "linear_bond": _linear_bond}


def translation(task):
    """The task as plain data."""
    document, start = task.scenario, task.start
    translate.check_keys(document, NAME, periodic=True, known={"dimension", "deformable", "cut", "stage", "history"}
                         | ({"interface"} if document["contacts"]["law"] == "hertz_mindlin" else set()))
    plane = document.get("dimension", 3) == 2
    laws = {document["contacts"]["law"], document.get("bonds", {}).get("law", "none")} - {"none"}
    if laws == {"linear_bond", "frictional"}:
        laws = {"linear_bond"}
    if len(laws) != 1 or not laws <= _LAWS.keys():
        raise Unsupported(f"yade: no translation of laws {', '.join(sorted(laws))} together")
    law = laws.pop()
    # only its bond with given stiffnesses is independent of areas and volumes of spheres
    if plane and law != "linear_bond":
        raise Unsupported("yade: dimension = 2 is translated only for linear bonds")
    deformable = translate.deformable(NAME, document, start)
    if deformable and law != "linear_bond":
        raise Unsupported("yade: deformable particles need linear bonds")
    integration = document.get("integration", {})
    gravity = vector(integration.get("gravity", [0, 0, 0]))
    fixed, velocity, spin = translate.prescribed(document, start)
    velocity = velocity.copy()
    loading, walls = {"kind": "none"}, translate.planes(document)
    if document.get("stage") and document.get("loading", {}).get("kind") != "cell-stress":
        raise Unsupported("yade: stages are translated only for cell-stress")
    if plane:
        for letters in fixed:
            letters |= set("zXY")
    if document.get("loading", {}).get("kind", "none") == "uniaxial":
        axis, low, high, area = translate.end_layers(document, start)
        letters = "xyz"[axis] if document["loading"].get("lateral", "free") == "free" else "xyzXYZ"
        for p in (*low, *high):
            fixed[p] |= set(letters)
        loading = dict(kind="uniaxial", axis=axis, low=low.tolist(), high=high.tolist(), area=area)
    elif document.get("loading", {}).get("kind") == "cell-strain":
        if document.get("prescribe"):
            raise Unsupported("yade: no translation of prescribed motion in a driven cell, because YADE moves blocked bodies with the cell")
        gradient = [vector(row) for row in document["loading"]["velocity_gradient"]]
        loading = dict(kind="cell-strain", velocity_gradient=gradient)
    elif document.get("loading", {}).get("kind") == "cell-stress":
        loading = _triaxial(document, start)
    elif translate.on_strips(document):
        across, held, moved, stress, strain = translate.flexure(document, start)
        for p in (*held, *moved):
            fixed[p].add("xyz"[across])
        velocity[held, across], velocity[moved, across] = 0.0, -si(document["loading"]["closing_velocity"])
        loading = dict(kind="flexure", across=across, held=held.tolist(), moved=moved.tolist(), stress=stress, strain=strain)
    elif document.get("loading", {}).get("kind") == "platens":
        plates, area, sign, length = translate.platens(document, start)
        loading = dict(kind="platens", axis=plates[0][0], first=len(start.radius) + len(walls), area=area, sign=sign, length=length)
        walls = [*walls, *plates]
    elif document.get("loading", {}).get("kind", "none") != "none":
        raise Unsupported(f"yade: no translation of loading {document['loading']['kind']}")
    meshes = [(v[t].tolist(), material, c.tolist(), w.tolist()) for v, t, material, c, w in translate.meshes(document)]
    if meshes and law != "hertz_mindlin":
        raise Unsupported("yade: meshes are translated only under hertz_mindlin")
    if walls and "bonds" in document and law != "cpm":
        raise Unsupported("yade: bonded particles touch walls only under cpm")
    if integration.get("scheme", "leapfrog") == "velocity-verlet":
        # Velocity Verlet is leapfrog with a first kick of half a step. YADE's first kick is a full step, so subtract half.
        free = np.array([[letter not in letters for letter in "xyz"] for letters in fixed])
        velocity -= np.where(free, 0.5 * start.dt * np.asarray(gravity), 0.0)
        if len(start.bonds) == 0 and np.any(start.mass == 0):
            raise Unsupported("yade: no translation of massless particles")
    force, moment = translate.forces(document, start)
    materials = [_LAWS[law](m, document, start) for m in document["material"]]
    if any(m.get("functor") != materials[0].get("functor") for m in materials):
        raise Unsupported("yade: omega_threshold and hardening must be equal for all materials, because they belong to the functor")
    output = document.get("output", {})
    # the operator record `whole` over all contacts corresponds to YADE's getStress
    whole = [si(s["region"].get("volume", 0)) for s in document.get("sample", [])
             if s.get("name") == "whole" and s["operator"] == "region-stress" and s["region"]["kind"] in ("all", "cell")]
    return dict(
        law=law, materials=materials,
        position=start.position.tolist(), radius=start.radius.tolist(), mass=start.mass.tolist(),
        # solid spheres or discs, as in ConcorDEM
        inertia=((0.5 if plane else 0.4) * start.mass * start.radius**2).tolist(), plane=plane, deformable=deformable,
        frozen=task.command == "operators",
        material=start.material.tolist(), velocity=velocity.tolist(), spin=spin.tolist(),
        fixed=["".join(sorted(f)) for f in fixed], force=force.tolist(), moment=moment.tolist(),
        walls=walls, meshes=meshes,
        pairs=[(a, b, mu, e) for (a, b), (mu, e) in translate.hertz_pairs(document).items()] if law == "hertz_mindlin" else [],
        interfaces="interface" in document, bonds=start.bonds.tolist(), severed=translate.severed(document, start).tolist(),
        ratio=si(document.get("bonds", {}).get("interaction_ratio", 1)),
        # Only YADE's kinematics correct the arms; all others use the common contact point.
        ratcheting_correction=document.get("kinematics", "finite") == "yade-ratcheting",
        spherical_bodies=not walls,
        dt=start.dt, damping=translate.local_damping(document), gravity=gravity, loading=loading,
        stress_volume=whole[0] if whole else None, cell=start.cell.tolist(), steps=translate.steps_of(document, start.dt), sample_interval=output.get("sample_interval", 10),
        snapshot_interval=output.get("snapshot_interval") or 10**9)


def _triaxial(document, start):
    """Phases of YADE's own servo, PeriTriaxController: steps, mask of the axes that follow their stress, goals, largest strain rates."""
    loading = document["loading"]
    stress = np.array([vector(row) for row in loading["stress"]])
    if np.any(stress != np.diag(np.diag(stress))):
        raise Unsupported("yade: the stress of a cell must have no shear")
    rates = [None if rate == "free" else si(rate) for rate in loading.get("strain_rate", ["free"] * 3)]
    phases = []
    for steps, by_stress in translate.stages(document) or [(translate.steps_of(document, start.dt), False)]:
        driven = [rate is not None and not by_stress for rate in rates]
        # the goal of a driven axis is a strain far away
        goal = [math.copysign(1.0, rates[k] or 1.0) if driven[k] else float(stress[k, k]) for k in range(3)]
        fastest = [abs(rates[k]) if driven[k] else si(loading["maximum_strain_rate"]) for k in range(3)]
        phases.append(dict(steps=steps, mask=sum(1 << k for k in range(3) if not driven[k]), goal=goal, fastest=fastest))
    axis = next((k for k in range(3) if rates[k]), int(np.argmax(np.abs(np.diag(stress)))))
    return dict(kind="cell-stress", phases=phases, axis=axis)


def _frozen(result, task, data, out):
    """The state of the last step for our operators, and the results of YADE's operators in our order of indices."""
    a, _ = pair = out["frozen_pair"].T
    spheres = len(task.start.radius)
    on_a, walls = out["frozen_force"], (pair >= spheres).any(axis=0)
    wall_first = walls & (a >= spheres)
    result.fields.update({
        "frozen/position": (out["frozen_position"], "m"), "frozen/radius": (task.start.radius, "m"), "frozen/pair": (pair.T[~walls], "1"),
        "frozen/point": (out["frozen_point"][~walls], "m"),
        "frozen/branch": (out["frozen_branch"][~walls], "m"),
        "frozen/force": (on_a[~walls], "N"), "frozen/wall_particle": (pair.min(axis=0)[walls], "1"),
        "frozen/wall_point": (out["frozen_point"][walls], "m"),
        "frozen/wall_force": (np.where(wall_first[:, None], -on_a, on_a)[walls], "N")})
    # YADE's stress is force times branch vector (quirk yade-stress-transposed)
    turned = lambda tensors: np.asarray(tensors).reshape(-1, 3, 3).transpose(0, 2, 1).reshape(-1, 9)
    volume = data["stress_volume"] or float(out["frozen_volume"])
    result.numbers["frozen"] = {"partition": "contact-point", "volume": volume, "full": True}
    result.numbers["measures"] = {
        "contacts": int((~walls).sum()), "particle_stress": turned(out["frozen_particle_stress"])[:spheres].ravel().tolist()}
    if not walls.any():
        # getStress includes walls; their branch vectors end at the positions of the wall bodies
        result.numbers["measures"]["stress"] = turned(out["frozen_stress"])[0].tolist()


def run(task, folder, limit):
    return _once(task, folder, limit)


_SCENE = "scene.yade.bin"


def run_in_two(task, folder, limit):
    """Half of the run, then the rest by another process from the scene that the first has saved."""
    half = selfcheck.half_of(task)
    places = [folder / name for name in ("first", "second")]
    for place in places:
        place.mkdir()
    before = _once(task, places[0], limit, steps=half, keep=_SCENE)
    (places[0] / _SCENE).rename(places[1] / _SCENE)
    return selfcheck.joined(before, _once(task, places[1], limit, **{"continue": _SCENE}), half)


def _once(task, folder, limit, **part):
    """A run, or the part of one that ends at other `steps`, `keep`s its scene in a file, or `continue`s from one."""
    data = {**translation(task), "keep": None, "continue": None, **part}
    if part and (data["deformable"] or data["loading"]["kind"] == "cell-stress"):
        raise Unsupported("yade: strains of particles and servos of cells are not saved with a scene")
    for change in task.plant.get("yade", []):
        change(data)
    (folder / "task.json").write_text(json.dumps(data))
    (folder / "yade_driver.py").write_text(_DRIVER)
    process.run(
        ["yade", "-n", "-x", "-j1", "yade_driver.py"], folder, limit,
        {**process.ONE_THREAD, "CONCORDEM_VALIDATE_TASK": "task.json", "CONCORDEM_VALIDATE_OUT": "yade.npz"})
    out = folder / "yade.npz"
    if not out.exists():
        raise Crashed("YADE ended without a result (see log.txt)")
    with np.load(out) as file:
        data_out = {name: file[name] for name in file.files}
    result = Result(NAME, float(data_out["time_step"]))
    samples, pictures = data_out["sample_steps"], data_out["snapshot_steps"]
    for name, unit in (("stress", "Pa"), ("strain", "1"), ("stored_deformation", "J")):
        if name in data_out:
            result.add(name, samples, data_out[name], unit)
    if "whole_volume" in data_out:
        result.add("whole.volume", samples, data_out["whole_volume"], "m^3")
    if "whole_stress" in data_out:
        # YADE's stress is force times branch vector, ours the transpose (quirk yade-stress-transposed)
        result.add("whole.stress", samples, data_out["whole_stress"].transpose(0, 2, 1), "Pa", "getStress, transposed")
    if "contact_force" in data_out:
        result.add("contact_force", samples, data_out["contact_force"], "N", "Force of the contact on particle 0")
    for name, unit in (("position", "m"), ("velocity", "m/s"), ("angular_velocity", "rad/s")):
        result.add(name, pictures, data_out[name], unit, "All particles")
    if "damage_field" in data_out:
        result.add("damage_field", pictures, data_out["damage_field"], "1", "Mean damage of the bonds of a particle")
    if task.command == "operators":
        _frozen(result, task, data, data_out)
    for name, unit in (("radius", "m"), ("mass", "kg"), ("inertia", "kg*m^2")):
        result.fields[name] = (data_out[name], unit)
    wall = float(data_out["wall_s"])
    result.numbers.update(wall_s=wall, particles=len(task.start.radius), steps=data["steps"],
                          particle_steps_per_s=len(task.start.radius) * data["steps"] / wall if wall else None)
    result.provenance.update(version=str(data_out["version"]), command="yade -n -x -j1 yade_driver.py",
                             velocity_at="half steps", threads="1")
    return result
