"""Heat between colliding grains in LAMMPS: `pair_style granular ... heat radius`, which conducts `2 λ a` through a Hertzian contact of the
radius `a = √(δ R*)`, and `fix heat/flow`. Our model `contacts` with `constriction` has the same equation for grains of one material.
"""
from ..errors import Unsupported
from ..quantity import si
from . import translate
from .liggghts import group_lines


def deck(document, start):
    """Lines of the input file, and the number of steps."""
    translate.check_keys(document, "lammps", known={"heat"})
    for key in ("bonds", "wall", "prescribe", "force", "loading"):
        if key in document:
            raise Unsupported(f"lammps: no translation of `{key}` with heat")
    heat, material = document["heat"], document["material"][0]
    translate.law_keys("lammps", heat, {"model", "temperature", "initial", "contact"})
    translate.law_keys("lammps", material["thermal"], {"specific_heat", "conductivity"})
    law = material.get("frictional", {})
    translate.law_keys("lammps", law, {"normal_stiffness", "shear_stiffness", "friction_coefficient"})
    if heat["model"] != "contacts" or not heat["contact"].get("constriction") or len(document["material"]) > 1:
        raise Unsupported("lammps: heat only in the model `contacts` with `contact.constriction` and one material")
    if document["contacts"]["law"] != "frictional" or si(law.get("friction_coefficient", 0)):
        raise Unsupported("lammps: heat only with linear contacts without friction")
    _, velocity, spin = translate.prescribed(document, start)
    steps = translate.steps_of(document, start.dt)
    travel = abs(velocity).max() * steps * start.dt + 20 * start.radius.max()
    number = lambda value: repr(float(value))
    low, high = start.position.min(axis=0) - travel, start.position.max(axis=0) + travel
    thermal = material["thermal"]
    lines = [
        "units si", "atom_style sphere", "atom_modify map array sort 0 0.0", "boundary f f f", "newton off", "comm_modify vel yes",
        "region box block " + " ".join(f"{number(low[k])} {number(high[k])}" for k in range(3)), "create_box 1 box"]
    lines += ["create_atoms 1 single " + " ".join(map(number, x)) for x in start.position]
    for p, (r, m) in enumerate(zip(start.radius, start.mass)):
        # the diameter sets the mass of a density of 1, so the mass comes last
        lines.append(f"set atom {p + 1} diameter {number(2 * r)} vx {number(velocity[p][0])} vy {number(velocity[p][1])} vz {number(velocity[p][2])}")
        lines.append(f"set atom {p + 1} mass {number(m)}")
    if spin.any():
        raise Unsupported("lammps: heat only without spins")
    lines += [f"fix state all property/atom temperature heatflow", f"set group all temperature {si(heat['temperature'])!r}"]
    sets = translate.members(document, start)
    for k, one in enumerate(heat.get("initial", [])):
        lines += [*group_lines(f"initial{k}", sets[one["set"]]), f"set group initial{k} temperature {si(one['temperature'])!r}"]
    lines += [
        f"neighbor {number(0.5 * start.radius.min())} bin", "pair_style granular",
        f"pair_coeff * * hooke {number(si(law['normal_stiffness']))} 0 tangential linear_nohistory 0 0 damping velocity "
        f"heat radius {number(si(thermal['conductivity']))}",
        "fix move all nve/sphere", f"fix conduct all heat/flow constant {number(si(thermal['specific_heat']))}",
        f"timestep {number(start.dt)}", "compute temperature all property/atom temperature",
        f"dump all all custom {document.get('output', {}).get('snapshot_interval') or steps} dump.txt id x y z c_temperature radius mass",
        "dump_modify all sort id format float %.17g", "thermo 1000000000", f"run {steps}"]
    return lines, steps
