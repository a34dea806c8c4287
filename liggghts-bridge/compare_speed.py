#!/usr/bin/env python3
"""Cost of our contacts through LIGGGHTS' native ones, and of bonds on 1 and 2 processors: time, memory, and what is communicated.

Times are processor times (of all processes of a run, waiting included, since MPI waits busily): the difference of a long and a short
run, medians of rounds that alternate, so that a busy machine slows all alike. Bytes are counted by Open MPI itself (its monitoring
component) on 8 processors of a periodic box, as the difference of a long and a short run again.
  liggghts-bridge/compare_speed.py [--rounds 3] [--json FILE]
"""
import argparse
import json
import os
import platform
import re
import statistics
import subprocess
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
LAUNCHER = os.path.join(os.environ.get("CARGO_TARGET_DIR", os.path.join(HERE, "../target")), "liggghts/concordem-liggghts")
ENVIRONMENT = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
EDGE = 22
SPACING = 0.0099
HEAD = """units si
atom_style sphere
atom_modify map array sort 0 0
boundary p p p
newton off
{processors}communicate single vel yes
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


def packing(folder, n=EDGE):
    edge = n * SPACING
    with open(os.path.join(folder, "packing.data"), "w") as out:
        out.write(f"packing\n\n{n**3} atoms\n1 atom types\n\n")
        for axis in "xyz":
            out.write(f"0 {edge} {axis}lo {axis}hi\n")
        out.write("\nAtoms\n\n")
        for k in range(n**3):
            x, y, z = (k % n, k // n % n, k // n**2)
            out.write(f"{k + 1} 1 0.01 2500 {x * SPACING:.17g} {y * SPACING:.17g} {z * SPACING:.17g}\n")
        out.write("\nVelocities\n\n")
        for k in range(n**3):
            v = [((k * a) % 1009 / 1009 - 0.5) * 0.02 for a in (7919, 104729, 1299709)]
            out.write(f"{k + 1} {v[0]:.17g} {v[1]:.17g} {v[2]:.17g} 0 0 0\n")


def run(folder, script, processors, steps, layout="", monitor=False):
    """What a run printed, and its processor time (s)."""
    with open(os.path.join(folder, "in"), "w") as out:
        out.write(HEAD.format(processors=layout) + script + f"thermo {steps}\nrun {steps}\n")
    command = [LAUNCHER, "in", "-log", "none"]
    if processors > 1:
        mpi = ["mpirun", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", "-np", str(processors)]
        if monitor:
            mpi += ["--mca", "pml_monitoring_enable", "2", "--mca", "pml_monitoring_enable_output", "3",
                    "--mca", "pml_monitoring_filename", "sent"]
        command = mpi + command
    with open(os.path.join(folder, "out"), "w+b") as out:
        process = subprocess.Popen(command, cwd=folder, env=ENVIRONMENT, stdout=out, stderr=subprocess.STDOUT)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        printed = out.read().decode(errors="replace")
    if process.returncode:
        raise SystemExit(f"compare_speed.py: LIGGGHTS failed:\n{printed}")
    return printed, usage.ru_utime + usage.ru_stime


def memory(folder, script):
    """Resident memory of a run on one processor (bytes): while it computes, and at most."""
    packing(folder, 40)
    with open(os.path.join(folder, "in"), "w") as out:
        out.write(HEAD.format(processors="") + script + "thermo 100\nrun 100\n")
    process = subprocess.Popen([LAUNCHER, "in", "-log", "none"], cwd=folder, env=ENVIRONMENT, stdout=subprocess.DEVNULL)
    samples, most = [], 0
    while process.poll() is None:
        try:
            with open(f"/proc/{process.pid}/status") as status:
                found = dict(re.findall(r"(VmRSS|VmHWM):\s+(\d+) kB", status.read()))
        except OSError:
            break
        if found:
            samples.append(int(found["VmRSS"]) * 1024)
            most = max(most, int(found["VmHWM"]) * 1024)
        time.sleep(0.01)
    if process.wait():
        raise SystemExit("compare_speed.py: LIGGGHTS failed")
    # The last third lies within the run.
    return statistics.median(samples[-max(1, len(samples) // 3):]), most


def of_step(folder, script, processors, steps=100):
    """Processor time of a step (s), share of communication in LIGGGHTS' own breakdown (%), bonds."""
    short = run(folder, script, processors, 20)[1]
    printed, long = run(folder, script, processors, 20 + steps)
    share = re.findall(r"Comm\s+time \(%\) = \S+ \((\S+)\)", printed)
    bonds = re.findall(r"concordem/bond: (\d+) bonds", printed)
    return (long - short) / steps, float(share[-1]) if share else float("nan"), int(bonds[0]) if bonds else 0


def sent(folder, script, steps):
    """Bytes and messages that all processes of a run sent to each other, and copies per process."""
    for name in os.listdir(folder):
        if name.startswith("sent"):
            os.remove(os.path.join(folder, name))
    printed, _ = run(folder, script, 8, steps, "processors 2 2 2\n", monitor=True)
    total = [0, 0]
    for name in os.listdir(folder):
        if name.startswith("sent"):
            with open(os.path.join(folder, name)) as file:
                # E: messages of the program itself; collective operations are counted apart
                for size, messages in re.findall(r"(?m)^E\t\d+\t\d+\t(\d+) bytes\t(\d+) msgs", file.read()):
                    total = [total[0] + int(size), total[1] + int(messages)]
    return total, float(re.findall(r"Nghost:\s+(\S+) ave", printed)[-1]), float(re.findall(r"Nlocal:\s+(\S+) ave", printed)[-1])


def communication(folder):
    """Per law and size of the part of a processor: its atoms, copies, bytes and messages per step."""
    figures = []
    for edge in (16, 24, 32, 44):
        packing(folder, edge)
        for law in ("cpm", "cohesive_beam"):
            script = BONDS.format(law=LAWS[law])
            (few, few_messages), copies, atoms = sent(folder, script, 5)
            (many, many_messages), _, _ = sent(folder, script, 25)
            figure = {"law": law, "atoms": atoms, "copies": copies, "bytes_per_step": (many - few) / 20 / 8,
                      "messages_per_step": (many_messages - few_messages) / 20 / 8}
            figure["bytes_per_copy"] = figure["bytes_per_step"] / copies
            figures.append(figure)
            print(f"  {law:14} {atoms:.0f} atoms and {copies:.0f} copies per processor: {figure['bytes_per_step']:.0f} bytes in "
                  f"{figure['messages_per_step']:.1f} messages per step, {figure['bytes_per_copy']:.1f} bytes per copy", flush=True)
    return figures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        print("what a processor sends, eight processors, periodic box:")
        result = {"communication": communication(folder), "load_average_before": os.getloadavg()}
        held = {}
        for law, text in LAWS.items():
            script = BONDS.format(law=text)
            pairs = zip(memory(folder, script), memory(folder, script.replace("bond distance 1.5", "bond none")))
            # nine bonds per sphere
            held[law] = [(with_ - without) / (9 * 40**3) for with_, without in pairs]
        packing(folder)
        times, bonded = {}, {}
        for _ in range(arguments.rounds):
            for model in ("hertz", "concordem/hertz"):
                times.setdefault(model, []).append(of_step(folder, CONTACTS.format(model=model), 1)[0])
            for law, text in LAWS.items():
                script = BONDS.format(law=text)
                for processors in (1, 2):
                    bonded.setdefault((law, processors), []).append(of_step(folder, script, processors))
        native, ours = (statistics.median(times[m]) for m in ("hertz", "concordem/hertz"))
        ratios = [b / a for a, b in zip(times["hertz"], times["concordem/hertz"])]
        result["contacts"] = {"spheres": EDGE**3, "hertz_s": native, "concordem_hertz_s": ours, "ratios": ratios}
        print(f"{EDGE**3} spheres, about 3 contacts each, one processor:")
        print(f"  hertz history      {native * 1e6:8.0f} us per step")
        print(f"  concordem/hertz    {ours * 1e6:8.0f} us per step, ratio {statistics.median(ratios):.2f} "
              f"(rounds: {', '.join(f'{ratio:.2f}' for ratio in ratios)})")
        result["bonds"] = []
        for (law, processors), found in bonded.items():
            bonds = found[0][2]
            steps = [f[0] / bonds * 1e9 for f in found]
            figure = {"law": law, "bonds": bonds, "processors": processors, "ns_per_bond_step": statistics.median(steps),
                      "rounds": steps, "communication_percent": statistics.median(f[1] for f in found)}
            if processors == 1:
                figure["bytes_per_bond"], figure["bytes_per_bond_at_most"] = held[law]
            result["bonds"].append(figure)
            print(f"  {law:14} {bonds} bonds on {processors}: {figure['ns_per_bond_step']:6.1f} ns per bond and step (rounds "
                  f"{min(steps):.0f} to {max(steps):.0f}), communication {figure['communication_percent']:.1f} % of the wall's time"
                  + (f", {figure['bytes_per_bond']:.0f} bytes per bond, {figure['bytes_per_bond_at_most']:.0f} at most"
                     if processors == 1 else ""))
    if arguments.json:
        commit = subprocess.run(["git", "-C", HERE, "rev-parse", "HEAD"], capture_output=True, text=True).stdout.strip()
        result |= {"commit": commit, "machine": f"{platform.machine()}, {os.cpu_count()} processors", "load_average": os.getloadavg()}
        with open(arguments.json, "w") as out:
            json.dump(result, out, indent=1)
            out.write("\n")


if __name__ == "__main__":
    main()
