#!/usr/bin/env python3
"""Cost of our contacts through LIGGGHTS' native ones, and of bonds, in one run each after the other.

Prints the median of several rounds; rounds alternate, so that a busy machine slows all alike.
  liggghts-bridge/compare_speed.py [rounds]
"""
import os
import re
import statistics
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
LAUNCHER = os.path.join(os.environ.get("CARGO_TARGET_DIR", os.path.join(HERE, "../target")), "liggghts/concordem-liggghts")
ENVIRONMENT = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
N = 22
SPACING = 0.0099
HEAD = """units si
atom_style sphere
atom_modify map array sort 0 0
boundary p p p
newton off
communicate single vel yes
read_data packing.data
neighbor 0.001 bin
neigh_modify delay 0
timestep 1e-7
"""
CONTACTS = """pair_style gran model {model} tangential history
pair_coeff * *
fix p1 all property/global youngsModulus peratomtype 5e7
fix p2 all property/global poissonsRatio peratomtype 0.3
fix p3 all property/global coefficientRestitution peratomtypepair 1 0.9
fix p4 all property/global coefficientFriction peratomtypepair 1 0.4
fix integrate all nve/sphere
"""
BONDS = """fix integrate all nve/sphere
fix bonds all concordem/bond {law} bond distance 1.5
thermo_style custom step f_bonds
"""
LAWS = {
    "linear_bond": "linear_bond normal_stiffness 1e6 shear_stiffness 4e5",
    "cpm": "cpm young 30e9 shear_ratio 0.2 cohesion 4.5e6 friction_coefficient 0.8 crack_onset_strain 1.5e-4 "
    "relative_ductility 10",
    "cohesive_beam": "cohesive_beam young 30e9 radius_ratio 0.5 tensile_strength 1e7",
}


def packing(folder):
    edge = N * SPACING
    with open(os.path.join(folder, "packing.data"), "w") as out:
        out.write(f"packing\n\n{N**3} atoms\n1 atom types\n\n")
        for axis in "xyz":
            out.write(f"0 {edge} {axis}lo {axis}hi\n")
        out.write("\nAtoms\n\n")
        for k in range(N**3):
            x, y, z = (k % N, k // N % N, k // N**2)
            out.write(f"{k + 1} 1 0.01 2500 {x * SPACING:.17g} {y * SPACING:.17g} {z * SPACING:.17g}\n")
        out.write("\nVelocities\n\n")
        for k in range(N**3):
            v = [((k * a) % 1009 / 1009 - 0.5) * 0.02 for a in (7919, 104729, 1299709)]
            out.write(f"{k + 1} {v[0]:.17g} {v[1]:.17g} {v[2]:.17g} 0 0 0\n")


def run(folder, script, processors, steps):
    with open(os.path.join(folder, "in"), "w") as out:
        out.write(HEAD + script + f"thermo {steps}\nrun 20\nrun {steps}\n")
    printed = subprocess.run(
        ["mpirun", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", "-np", str(processors), LAUNCHER, "in", "-log", "none"],
        cwd=folder, env=ENVIRONMENT, check=True, capture_output=True, text=True, errors="replace").stdout
    seconds = float(re.findall(r"Loop time of (\S+)", printed)[-1])
    part = re.findall(r"Comm\s+time \(%\) = \S+ \((\S+)\)", printed)
    bonds = re.findall(r"concordem/bond: (\d+) bonds", printed)
    return seconds / steps, float(part[-1]) if part else float("nan"), int(bonds[0]) if bonds else 0


def main():
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    with tempfile.TemporaryDirectory() as folder:
        packing(folder)
        times = {}
        for _ in range(rounds):
            for model in ("hertz", "concordem/hertz"):
                script = CONTACTS.format(model=model)
                times.setdefault(model, []).append(run(folder, script, 1, 200)[0])
        native, ours = (statistics.median(times[m]) for m in ("hertz", "concordem/hertz"))
        print(f"{N**3} spheres, about 3 contacts each, one processor:")
        print(f"  hertz history      {native * 1e6:8.0f} us per step")
        print(f"  concordem/hertz    {ours * 1e6:8.0f} us per step, ratio {ours / native:.2f} "
              f"(rounds: {', '.join(f'{b / a:.2f}' for a, b in zip(times['hertz'], times['concordem/hertz']))})")
        for law, text in LAWS.items():
            for processors in (1, 2):
                found = [run(folder, BONDS.format(law=text), processors, 100) for _ in range(rounds)]
                step = statistics.median(f[0] for f in found)
                bonds = found[0][2]
                print(f"  {law:14} {bonds} bonds on {processors}: {step / bonds * 1e9:6.1f} ns per bond and step, "
                      f"communication {statistics.median(f[1] for f in found):.1f} %")


main()
