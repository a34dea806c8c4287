"""The cases: which programs run on which input, what must be equal, and the ratio that counts."""
from dataclasses import dataclass, field
from typing import Callable

from . import inputs, programs


@dataclass
class Check:
    """Relative difference of a number in the states of two sides."""
    sides: tuple
    key: str
    tolerance: float
    reason: str


@dataclass
class Ratio:
    """Time of the first side over that of the second; `goal` is a lower bound if `at_least`, otherwise an upper one; None: no goal."""
    name: str
    sides: tuple
    goal: float | None
    at_least: bool = True
    value: str = "ns"


@dataclass
class Case:
    name: str
    what: str
    #: Side name -> function that runs it.
    sides: dict[str, Callable]
    ratios: list[Ratio]
    checks: list[Check] = field(default_factory=list)


YADE_FORM = ("The same law and kinematics, but forces are summed in another order. Coordinates of 5 cm have a rounding of 7e-18 m, elongations are "
             "3e-9 m: 2e-9 in each force and step, which a hundred steps and a grip of thousands of bonds add up. Measured 2.5e-7 (cube), 1e-10 (prism).")
CORRECTED = "Other kinematics and the corrected law: the published difference of stiffness is 2.4 %, so 5 % tell a wrong input only."


def _cpm(packing, steps, threads):
    one = {"steps": steps, "threads": threads}
    return Case(
        f"cpm-yade-{threads}",
        f"concrete specimen in tension, elastic, {threads} thread{'s' if threads > 1 else ''}",
        {
            "YADE": lambda: programs.yade(packing, **one),
            "ours": lambda: programs.ours(packing, "cpm", **one),
            "ours, YADE's form": lambda: programs.ours(packing, "cpm-yade", kinematics="yade-ratcheting", **one),
            "our engine in YADE, motion": lambda: programs.yade(packing, engine=["yade-ratcheting", "yade-public", True], **one),
        },
        [Ratio("YADE / ours", ("YADE", "ours"), 12), Ratio("YADE / ours in YADE's form", ("YADE", "ours, YADE's form"), 8),
         Ratio("YADE / our engine inside YADE, motion=True", ("YADE", "our engine in YADE, motion"), 5)],
        [Check(("YADE", "ours, YADE's form"), "grip_force", 2e-6, YADE_FORM),
         Check(("YADE", "our engine in YADE, motion"), "rms_displacement", 1e-9, "The same law and kinematics; rounding of sums."),
         Check(("YADE", "ours"), "grip_force", 0.05, CORRECTED)])


def _breaking(steps):
    setup = {"steps": steps, "rate": 10.0, "ductility": 3, "break_at": 0.97}
    form = {"kinematics": "yade-ratcheting"}
    run = lambda law, **more: programs.ours(inputs.GOLD, law, **setup, **more)
    same = "Bit for bit the same law until rounding of sums decides when a bond breaks: some bonds of thousands."
    return Case(
        "small-breaking",
        "1,160 spheres pulled apart at 10 1/s until they break: processor time of whole runs, programs' starts included",
        {
            "YADE": lambda: programs.yade(inputs.GOLD, **setup),
            "our engine in YADE": lambda: programs.yade(inputs.GOLD, engine=["yade-ratcheting", "yade-public", False], **setup),
            "our engine in YADE, motion": lambda: programs.yade(inputs.GOLD, engine=["yade-ratcheting", "yade-public", True], **setup),
            "ours, YADE's form": lambda: run("cpm-yade", **form),
            "ours": lambda: run("cpm"),
        },
        [Ratio("YADE / ours", ("YADE", "ours"), 5, value="process_s"),
         Ratio("YADE / ours in YADE's form", ("YADE", "ours, YADE's form"), 5, value="process_s"),
         Ratio("YADE / our engine inside YADE", ("YADE", "our engine in YADE"), 3, value="process_s"),
         Ratio("YADE / our engine inside YADE, motion=True", ("YADE", "our engine in YADE, motion"), 3, value="process_s"),
         Ratio("YADE / our engine inside YADE, motion=True, steps alone", ("YADE", "our engine in YADE, motion"), 3)],
        [Check(("YADE", "ours, YADE's form"), "bonds", 0.01, same),
         Check(("YADE", "our engine in YADE"), "bonds", 0.01, same),
         Check(("our engine in YADE", "our engine in YADE, motion"), "rms_displacement", 0, "The same bits.")])


def _beams(edge, steps, folder):
    packing = inputs.lattice(folder, edge, 0.01, 0.005, periodic=False)
    beam = {"young": 30e9, "density": 2500, "time_step": 1e-7, "shake": 0.01, "ratio": 1.05, "steps": steps}
    return Case(
        f"beams-lammps-{edge**3}",
        f"cubic lattice of {edge**3:,} spheres with beams, one thread, against bpm/rotational",
        {"LAMMPS": lambda: programs.lammps(edge, 3, steps), "ours": lambda: programs.ours(packing, "cohesive_beam", **beam)},
        [Ratio("LAMMPS / ours", ("LAMMPS", "ours"), 8 if edge > 20 else 6)],
        [Check(("LAMMPS", "ours"), "rms_displacement", 1e-3,
               "The same stiffnesses; rotations of 1e-4 are measured in two ways, which differ by their square, and forces by their order.")])


def _hertz(edge, threads, steps, folder):
    packing = inputs.lattice(folder, edge, 0.0099, 0.005, periodic=True)
    grain = {"young": 5e7, "density": 2500, "time_step": 1e-7, "shake": 0.01, "steps": steps, "threads": threads}
    return Case(
        f"hertz-liggghts-{threads}",
        f"periodic bed of {edge**3:,} frictional Hertz spheres, {threads} thread{'s' if threads > 1 else ''} or processes",
        {"LIGGGHTS": lambda: programs.liggghts(edge, threads, steps), "ours": lambda: programs.ours(packing, "hertz_mindlin", **grain)},
        [Ratio("LIGGGHTS / ours", ("LIGGGHTS", "ours"), 2)],
        [Check(("LIGGGHTS", "ours"), "rms_displacement", 2e-3,
               "LIGGGHTS scales the shear spring with the overlap of the present step only (quirk liggghts-hertz-shear-spring).")])


#: Memory of a bonded simple cubic lattice, bytes per particle, rounded up.
BYTES_PER_PARTICLE = 2_200


def _free_memory():
    """Memory that the system can give without swapping, bytes."""
    with open("/proc/meminfo") as file:
        return next(int(line.split()[1]) * 1024 for line in file if line.startswith("MemAvailable"))


def _sizes(quick):
    """Simple cubic lattices with bonds to the six neighbors, as large as the free memory allows: 10⁷ particles need some 22 GB."""
    edges = {"10⁵": 46, "10⁶": 100, "10⁷": 215} if not quick else {"small": 10, "large": 20}
    free = _free_memory()
    edges = {name: edge for name, edge in edges.items() if edge**3 * BYTES_PER_PARTICLE < free}
    steps = 20 if not quick else 10
    names = list(edges)
    # As many bond-steps in each run; at least one part of ten steps.
    runs = {name: max(steps, steps * edges[names[-1]] ** 3 // edge**3 // 20) for name, edge in edges.items()}
    side = lambda name: lambda: programs.ours(f"sc:{edges[name]}", "cpm", ratio=1.05, steps=runs[name], warmup=5)
    return Case(
        "sizes", f"time per bond and step of lattices of {' and '.join(names[1:])} over {names[0]} concrete spheres, one thread",
        {name: side(name) for name in names},
        [Ratio(f"{name} / {names[0]}", (name, names[0]), 1.1, at_least=False) for name in names[1:]])


def _memory(quick):
    edge = 20 if quick else 100
    return Case(
        "memory", f"largest memory of a process that builds and steps {edge**3 // 2:,} concrete spheres with 6 bonds each, kB per particle",
        {"ours": lambda: programs.ours(f"fcc:{edge}", "cpm", ratio=1.05, steps=10, warmup=5)},
        [Ratio("kB per particle", ("ours", "ours"), 1.6, at_least=False, value="memory")])


def _start(folder, quick):
    edge = 20 if quick else 100
    return Case(
        "start", f"wall time of a run of two steps of {edge**3:,} concrete spheres from a stored packing, two threads, s",
        {"ours": lambda: programs.start(folder, edge)},
        [Ratio("from the start of the command to the end of the first step", ("ours", "ours"), 5, at_least=False, value="first_step_s"),
         Ratio("whole run, with its result", ("ours", "ours"), None, at_least=False, value="wall_s")])


def all_cases(folder, quick):
    """All cases; `quick`: small inputs and few steps, to test the programs and not their speed."""
    packing = inputs.specimen(folder, quick)
    # YADE needs minutes for a round of the specimen; its steps scatter by less than the machine.
    steps, edges, edge = (100, [10], 10) if quick else (100, [14, 22], 22)
    ours = lambda law, **more: lambda: programs.ours(packing, law, steps=steps, **more)
    exact = "Bit for bit: the contract."
    broken = {"rate": 10.0, "ductility": 3, "break_at": 0.97, "steps": 1000, "warmup": 200}
    cases = [
        _cpm(packing, steps, 1),
        _cpm(packing, steps, 2),
        *[_beams(e, 2 * steps, folder) for e in edges],
        _breaking(1000 if quick else 3000),
        *[_hertz(edge, threads, 4 * steps, folder) for threads in (1, 2)],
        Case("threads", "concrete specimen, one thread over two, by the wall clock",
             {"one": ours("cpm"), "two": ours("cpm", threads=2), "two runs": lambda: programs.ours_twice(packing, "cpm", steps=steps)},
             [Ratio("one / two threads", ("one", "two"), 1.9, value="wall_ns"),
              Ratio("one run alone / per run, two at once: what the machine allows", ("one", "two runs"), None, value="wall_ns")],
             [Check(("one", "two"), "grip_force", 0.0, exact), Check(("one", "two"), "rms_displacement", 0.0, exact)]),
        Case("deformable", "linear bonds between deformable particles over those between rigid ones, one thread",
             {"deformable": ours("deformable"), "rigid": ours("linear_bond")},
             [Ratio("deformable / rigid", ("deformable", "rigid"), 1.35, at_least=False)]),
        Case("breaking-steps", "steps in which bonds break over those in which none does, medians of one run, while the specimen fails at 10 1/s",
             {"ours": lambda: programs.ours(packing, "cpm", **broken)},
             [Ratio("breaking / quiet", ("ours", "ours"), 1.2, at_least=False, value="breaking")]),
        _sizes(quick),
        _memory(quick),
        _start(folder, quick),
    ]
    return {case.name: case for case in cases}
