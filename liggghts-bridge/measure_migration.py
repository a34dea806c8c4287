#!/usr/bin/env python3
"""Memory per process while a lattice of bonds drifts through the borders of processes: it must stay flat, and no bond may be lost.

A cubic lattice with a beam to each of six neighbors fills a periodic box. It drifts along the diagonal, as a rule by one sphere in 100 steps, so that
lists are built every few steps and atoms migrate over faces, edges, and corners of the grid of processes. At each tenth of the run the resident memory
of every process is read. A case passes if the number of bonds is that of the lattice, and the largest process is at most 5 % larger in the second
half of the run than in the first. Finished cases stay in validation/results/host-migration.json and are not run again.
  liggghts-bridge/measure_migration.py --bonds 1e5 1e6           both hosts, 8 processes, 1,000 steps
  liggghts-bridge/measure_migration.py --bonds 1e7 --drift 3
"""
import argparse
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(HERE)
RESULTS = os.path.join(ROOT, "validation/results/host-migration.json")
MOST_GROWTH = 0.05
LAW = "cohesive_beam young 1e8 poisson 0.3 radius 0.004 bond distance 1.05 contact none"
SCRIPT = {
    "liggghts": """units si
atom_style granular
atom_modify map hash sort 0 0
boundary p p p
newton off
communicate single vel yes
lattice sc 0.01
region box block 0 {side} 0 {side} 0 {side} units box
create_box 1 box
create_atoms 1 box
set group all diameter 0.01 density 2500
""",
    "lammps": """units si
atom_style sphere
atom_modify map hash sort 0 0
boundary p p p
newton off
comm_modify vel yes
lattice sc 0.01
region box block 0 {side} 0 {side} 0 {side} units box
create_box 1 box
create_atoms 1 box
set group all diameter 0.01
set group all density 2500
pair_style zero 0.0105
pair_coeff * *
""",
}
# Half of the skin, 1 mm, in ten steps if the lattice drifts by ten spheres; a wave of 0.1 m/s, so that forces are not zero.
REST = """neighbor 2e-3 bin
neigh_modify every 1 delay 0
timestep 1e-6
velocity all set {x} {y} {z}
variable wave atom 0.1*sin(6.283185307179586*z/{edge}/0.01)
variable speed atom {x}+v_wave
velocity all set v_speed NULL NULL
fix bonds all concordem/bond {law}
fix integrate all nve/sphere
thermo_style custom step atoms f_bonds f_bonds[2]
thermo {every}
run {steps}
"""


def command(host, processes, script):
    """The line that starts the host, and its environment."""
    environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    target = os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target"))
    if host == "liggghts":
        launcher = ["mpirun", "--oversubscribe", "--bind-to", "none", "--mca", "mpi_yield_when_idle", "1"]
        program = [os.path.join(target, "liggghts/concordem-liggghts")]
    else:
        venv = os.path.join(ROOT, ".venv-lammps/bin")
        launcher, program = [os.path.join(venv, "mpirun")], [os.path.join(venv, "lmp")]
        environment["LAMMPS_PLUGIN_PATH"] = os.path.join(target, "lammps")
        # As in the tests: MPICH polls without end while it waits.
        environment["MPIR_CVAR_CH4_PROGRESS_THROTTLE"] = "1"
        environment["MPIR_CVAR_CH4_PROGRESS_THROTTLE_NO_PROGRESS_COUNT"] = "1"
    return [*launcher, "-np", str(processes), *program, "-in", script, "-log", "none"], environment


def resident(script):
    """Resident memory in MB of each process that runs this script."""
    sizes = []
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{pid}/cmdline", "rb") as file:
                words = file.read().split(b"\0")
            with open(f"/proc/{pid}/status", encoding="ascii") as file:
                status = file.read()
        except OSError:
            continue
        name = os.path.basename(words[0])
        if script.encode() in words and name in (b"lmp", b"liggghts"):
            sizes.append(int(re.search(r"VmRSS:\s*(\d+)", status)[1]) / 1024)
    return sorted(sizes)


def growth_of(memory):
    """Growth of the peak from the first half of the run to the second: planes of the lattice that cross borders change the number of atoms of a process
    by some percent all the time."""
    half = len(memory) // 2
    return max(memory[half:]) / max(memory[:half]) - 1


def measure(host, bonds, drift, processes, steps):
    """Run one case; return its record."""
    edge = round((bonds / 3) ** (1 / 3))
    speed = {axis: share * drift for axis, share in zip("xyz", (5.8, 5.7, 5.6))}
    with tempfile.TemporaryDirectory() as folder:
        script = os.path.join(folder, "drift.in")
        with open(script, "w", encoding="ascii") as file:
            file.write(SCRIPT[host].format(side=0.01 * edge) + REST.format(edge=edge, law=LAW, every=steps // 10, steps=steps, **speed))
        arguments, environment = command(host, processes, script)
        rows, memory, lines, began = [], [], [], time.monotonic()
        run = subprocess.Popen(arguments, cwd=folder, env=environment, text=True, errors="replace", stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        for line in run.stdout:
            lines.append(line)
            if re.fullmatch(r"\s*\d+(\s+[\d.e+]+){3}\s*", line):
                rows.append([float(word) for word in line.split()])
                memory.append(max(resident(script), default=0.0))
                print(f"  step {rows[-1][0]:.0f}: {memory[-1]:.0f} MB, {time.monotonic() - began:.0f} s", flush=True)
        code = run.wait()
    seconds = time.monotonic() - began
    # The last row is printed when the run has ended; processes may be gone.
    memory = memory[:-1]
    if code != 0 or len(rows) != 11 or min(memory) == 0.0:
        sys.exit(f"{host} ended with code {code} and {len(rows)} rows:\n{''.join(lines[-30:])}")
    growth = growth_of(memory)
    kept = all(row[1] == edge**3 and row[2] == 3 * edge**3 and row[3] == 0 for row in rows[1:])
    return {
        "host": host,
        "bonds": 3 * edge**3,
        "processes": processes,
        "steps": steps,
        "drift_per_1000_steps": drift,
        "seconds": round(seconds),
        "largest_resident_MB": [round(size, 1) for size in memory],
        "growth_of_second_half": round(growth, 4),
        "bonds_kept": kept,
        "passed": kept and growth < MOST_GROWTH,
        "processors": os.cpu_count(),
        "machine": platform.machine(),
    }


def main():
    """Run the cases that the file of results lacks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bonds", type=float, nargs="+", default=[1e5, 1e6])
    parser.add_argument("--host", choices=SCRIPT, action="append", help="default: both")
    parser.add_argument("--processes", type=int, default=8)
    parser.add_argument("--steps", type=int, default=1000, help="a multiple of 10")
    parser.add_argument("--drift", type=float, default=10, help="spheres that the lattice drifts in 1,000 steps")
    options = parser.parse_args()
    if options.steps < 10 or options.steps % 10:
        parser.error(f"--steps {options.steps}: give a multiple of 10")
    results = []
    if os.path.exists(RESULTS):
        with open(RESULTS, encoding="utf-8") as file:
            results = json.load(file)
    for bonds in options.bonds:
        for host in options.host or SCRIPT:
            case = (host, 3 * round((bonds / 3) ** (1 / 3)) ** 3, options.processes, options.steps, options.drift)
            if any(case == tuple(done[key] for key in ("host", "bonds", "processes", "steps", "drift_per_1000_steps")) for done in results):
                print(f"{case}: done")
                continue
            print(case, flush=True)
            results.append(measure(host, bonds, options.drift, options.processes, options.steps))
            temporary = RESULTS + ".new"
            with open(temporary, "w", encoding="utf-8") as file:
                json.dump(results, file, indent=1)
                file.write("\n")
            os.replace(temporary, RESULTS)
    return 0 if all(done["passed"] for done in results) else 1


if __name__ == "__main__":
    sys.exit(main())
