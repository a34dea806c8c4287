#!/usr/bin/env python3
"""Time of our contacts relative to LIGGGHTS' own, and time, memory, and communication of bonds on 1 and 2 processors.

Times are CPU times of all processes of a run, including waiting, because MPI waits actively: the difference between a long and a
short run. Rounds alternate between the cases, so that a busy machine slows them equally; results are medians. The monitoring
component of Open MPI counts the bytes sent on 8 processors in a periodic box, again as the difference of two runs.
  liggghts-bridge/compare_speed.py [--rounds 15]   measures, writes validation/results/liggghts-speed.json, prints the blocks for
                                                   docs/book/evidence/liggghts.md
  liggghts-bridge/compare_speed.py --memory        measures the memory alone, and replaces those figures in the results file
  liggghts-bridge/compare_speed.py --rebuild       instead, the time of a rebuild of our bonds, in steps: runs that rebuild the lists in
                                                   every step, minus runs that never do, beside the same without bonds; the fastest
                                                   of the rounds; writes validation/results/liggghts-rebuild.json
  liggghts-bridge/compare_speed.py --docs          prints the blocks from the results file
  liggghts-bridge/compare_speed.py --check         fails if the blocks in docs/book/evidence/liggghts.md are not up to date
"""
import argparse
import json
import math
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "../validation"))
from concordem_validate import provenance

LAUNCHER = os.path.join(os.environ.get("CARGO_TARGET_DIR", os.path.join(HERE, "../target")), "liggghts/concordem-liggghts")
ENVIRONMENT = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
RESULTS = os.path.join(HERE, "../validation/results/liggghts-speed.json")
REBUILDS = os.path.join(HERE, "../validation/results/liggghts-rebuild.json")
DOCS = os.path.join(HERE, "../docs/book/evidence/liggghts.md")
EDGE = 22
# Additional steps of the long run. They take seconds, while the start-up time varies by hundredths of a second.
CONTACT_STEPS, BOND_STEPS = 1000, 300
SPACING = 0.0099
HEAD = """units si
atom_style sphere
atom_modify sort 0 0
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
    """Run a script; return its output and CPU time (s)."""
    with open(os.path.join(folder, "in"), "w") as out:
        out.write(HEAD.format(processors=layout) + script + f"thermo {steps}\nrun {steps}\n")
    command = [LAUNCHER, "in", "-log", "none"]
    if processors > 1:
        mpi = ["mpirun", "--oversubscribe", "--bind-to", "none", "--mca", "mpi_yield_when_idle", "1", "-np", str(processors)]
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
    """Resident memory of a run on one processor (bytes): during the computation, and the maximum."""
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
    # The last third of the samples falls into the computation.
    return statistics.median(samples[-max(1, len(samples) // 3):]), most


def memory_of_bonds(folder):
    """Memory per bond (bytes) by law: during the computation, and the maximum."""
    held = {}
    for law, text in LAWS.items():
        script = BONDS.format(law=text)
        pairs = zip(memory(folder, script), memory(folder, script.replace("bond distance 1.5", "bond none")))
        # Nine bonds per sphere.
        held[law] = [(with_ - without) / (9 * 40**3) for with_, without in pairs]
    return held


def of_step(folder, script, processors, steps):
    """CPU time per step (s), percentage of communication in LIGGGHTS' breakdown, number of bonds."""
    short = run(folder, script, processors, 20)[1]
    printed, long = run(folder, script, processors, 20 + steps)
    share = re.findall(r"Comm\s+time \(%\) = \S+ \((\S+)\)", printed)
    bonds = re.findall(r"concordem/bond: (\d+) bonds", printed)
    return (long - short) / steps, float(share[-1]) if share else float("nan"), int(bonds[0]) if bonds else 0


def rebuilds(folder, rounds, edge=30):
    """Time of a rebuild over that of a step, for each law in a periodic box with nine bonds per sphere."""
    packing(folder, edge)
    lists = {"never": "neigh_modify every 1000 delay 1000\n", "always": "neigh_modify every 1 delay 0 check no\n"}
    scripts = {law: BONDS.format(law=text) for law, text in LAWS.items()}
    scripts["none"] = scripts["cpm"].replace("bond distance 1.5", "bond none")
    best = {(law, when): math.inf for law in scripts for when in lists}
    for _ in range(rounds):
        for law, when in best:
            best[law, when] = min(best[law, when], of_step(folder, lists[when] + scripts[law], 1, 100)[0])
    host = best["none", "always"] - best["none", "never"]
    for law in LAWS:
        # A whole step of LIGGGHTS, with our bonds; LIGGGHTS' own rebuild is subtracted.
        step, rebuild = best[law, "never"], best[law, "always"] - best[law, "never"] - host
        print(f"{law:14} step {step * 1e3:6.1f} ms, rebuild {rebuild * 1e3:6.1f} ms: {rebuild / step:.2f} steps", flush=True)
        yield {"style": law, "spheres": edge**3, "bonds": 9 * edge**3, "step_s": step, "rebuild_s": rebuild, "rebuild_in_steps": rebuild / step}


def sent(folder, script, steps):
    """[bytes, messages] sent between all processes of a run, ghosts per process, owned atoms per process."""
    for name in os.listdir(folder):
        if name.startswith("sent"):
            os.remove(os.path.join(folder, name))
    printed, _ = run(folder, script, 8, steps, "processors 2 2 2\n", monitor=True)
    total = [0, 0]
    for name in os.listdir(folder):
        if name.startswith("sent"):
            with open(os.path.join(folder, name)) as file:
                # E: point-to-point messages; collective operations are counted separately.
                for size, messages in re.findall(r"(?m)^E\t\d+\t\d+\t(\d+) bytes\t(\d+) msgs", file.read()):
                    total = [total[0] + int(size), total[1] + int(messages)]
    return total, float(re.findall(r"Nghost:\s+(\S+) ave", printed)[-1]), float(re.findall(r"Nlocal:\s+(\S+) ave", printed)[-1])


def communication(folder):
    """Atoms, ghosts ("copies"), bytes, and messages per processor and step, for each law and subdomain size."""
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
            print(f"  {law:14} {atoms:.0f} atoms and {copies:.0f} ghosts per processor: {figure['bytes_per_step']:.0f} bytes in "
                  f"{figure['messages_per_step']:.1f} messages per step, {figure['bytes_per_copy']:.1f} bytes per ghost", flush=True)
    return figures


def interval(values):
    """Confidence interval of the median (low, high) and its confidence: at least 95 %, or the extremes if there are too few values."""
    ordered, n = sorted(values), len(values)

    def outside(cut):
        # The number of values below the median is binomially distributed.
        return 2 * sum(math.comb(n, k) for k in range(cut + 1)) / 2**n

    cut = 0
    while outside(cut + 1) <= 0.05:
        cut += 1
    return ordered[cut], ordered[n - 1 - cut], max(1 - outside(cut), 0.0)


def scatter(values):
    """Half width of that interval over the median."""
    low, high, _ = interval(values)
    return (high - low) / 2 / statistics.median(values)


def measure(rounds):
    with tempfile.TemporaryDirectory() as folder:
        load = os.getloadavg()
        print("communication per processor, eight processors, periodic box:")
        result = {"communication": communication(folder)}
        held = memory_of_bonds(folder)
        packing(folder)
        times, bonded = {}, {}
        for k in range(rounds):
            # Alternate the order, so that a drift in machine speed favors neither.
            for model in ("hertz", "concordem/hertz")[:: 1 if k % 2 else -1]:
                times.setdefault(model, []).append(of_step(folder, CONTACTS.format(model=model), 1, CONTACT_STEPS)[0])
            for law, text in LAWS.items():
                for processors in (1, 2):
                    bonded.setdefault((law, processors), []).append(of_step(folder, BONDS.format(law=text), processors, BOND_STEPS))
            times_by_law = ", ".join(f"{law} on {p} {found[-1][0] / found[-1][2] * 1e9:.1f} ns" for (law, p), found in bonded.items())
            print(f"round {k + 1} of {rounds}: ratio {times['concordem/hertz'][-1] / times['hertz'][-1]:.3f}, {times_by_law}",
                  flush=True)
    native, ours = times["hertz"], times["concordem/hertz"]
    result["contacts"] = {"spheres": EDGE**3, "steps": CONTACT_STEPS, "hertz_s": statistics.median(native),
                          "concordem_hertz_s": statistics.median(ours), "ratios": [b / a for a, b in zip(native, ours)]}
    result["bonds"] = []
    for (law, processors), found in bonded.items():
        steps = [f[0] / f[2] * 1e9 for f in found]
        figure = {"law": law, "bonds": found[0][2], "processors": processors, "ns_per_bond_step": statistics.median(steps),
                  "rounds": steps, "communication_percent": statistics.median(f[1] for f in found)}
        if processors == 1:
            figure["bytes_per_bond"], figure["bytes_per_bond_at_most"] = held[law]
        result["bonds"].append(figure)
    return result | circumstances(load)


def circumstances(load):
    """Commit, machine, and load of a record that began with the load `load`."""
    commit = subprocess.run(["git", "-C", HERE, "rev-parse", "HEAD"], capture_output=True, text=True).stdout.strip()
    return {"commit": commit, "machine": f"{provenance.processor()}, {os.cpu_count()} processors",
            "load_average_before": load, "load_average": os.getloadavg()}


def save(path, result):
    with open(path, "w") as out:
        json.dump(result, out, indent=1)
        out.write("\n")


def digits(value, count=2):
    """`value` with `count` significant digits, without exponent."""
    places = max(count - 1 - math.floor(math.log10(value)), 0)
    text = f"{value:.{places}f}"
    return text.rstrip("0").rstrip(".") if places else text


def cost(result):
    """Lines of the docs about times and memory."""
    contacts, bonds = result["contacts"], result["bonds"]
    ratios = contacts["ratios"]
    low, high, confidence = interval(ratios)
    before, after = result["load_average_before"][0], result["load_average"][0]
    lines = [
        f"{len(ratios)} rounds, {result['machine']}, load {before:.1f} before them and {after:.1f} at their end.",
        f"`concordem/hertz tangential history` takes {statistics.median(ratios):.2f} of the CPU time of LIGGGHTS' `hertz tangential",
        f"history` ({math.floor(confidence * 100)} % confidence of the median {low:.2f} to {high:.2f}, "
        f"rounds {min(ratios):.2f} to {max(ratios):.2f}).",
        "",
        "| | one processor | two, including waiting | communication (LIGGGHTS' breakdown, one processor) | memory: during the run, peak |",
        "|---|---|---|---|---|",
    ]

    def time(figure):
        rounds = figure["rounds"]
        return f"{figure['ns_per_bond_step']:.0f} ns per bond ({min(rounds):.0f} to {max(rounds):.0f})"

    for law in LAWS:
        one, two = (next(f for f in bonds if f["law"] == law and f["processors"] == p) for p in (1, 2))
        lines.append(f"| {law} | {time(one)} | {time(two).replace(' per bond', '')} | {one['communication_percent']:.1f} % | "
                     f"{one['bytes_per_bond']:.0f} bytes per bond, {one['bytes_per_bond_at_most']:.0f} |")
    return lines


def rebuild_cost():
    """Lines of the docs about rebuilds."""
    with open(REBUILDS) as file:
        found = json.load(file)
    times = ", ".join(f"{f['rebuild_s'] * 1e3:.1f} ms or {f['rebuild_in_steps']:.2f} steps (`{f['style']}`)" for f in found["figures"])
    first = found["figures"][0]
    return [f"A rebuild of the bonds, when LIGGGHTS rebuilds its lists, takes {times}; the target is two steps. {found['machine']}, "
            f"{first['spheres']:,} spheres with {first['bonds'] / first['spheres']:.0f} bonds each, fastest of {found['rounds']} rounds."]


def step_of(result, law, m, breaking=0.0):
    """Weak-scaling model of a step for m³ atoms per processor: bonds, computing time (s), ghosts, bytes sent, time to pack a ghost (s).

    `breaking`: bond evaluations per bond that a step in which bonds break takes more (measure_scale.py). Breaks send nothing.
    """
    one = next(f for f in result["bonds"] if f["law"] == law and f["processors"] == 1)
    counted = [f for f in result["communication"] if f["law"] == law]
    # On one processor, the ghosts are periodic images; take the counted case with the same number of atoms.
    same = next(f for f in counted if f["atoms"] == EDGE**3)
    packed = one["communication_percent"] / 100 * one["ns_per_bond_step"] * one["bonds"] / same["copies"]
    bonds, copies = 9 * m**3, (m + 3) ** 3 - m**3
    return bonds, bonds * (1 + breaking) * one["ns_per_bond_step"] * 1e-9, copies, copies * counted[0]["bytes_per_copy"], packed * 1e-9


def sending(result, law, m, latency, bandwidth, breaking=0.0):
    """Communication time of a step (s) and parallel efficiency, for a latency in s and a bandwidth in bytes/s.

    `breaking`: as for `step_of`. One process with breaks is enough: the others wait for it.
    """
    bonds, computing, copies, sent, packed = step_of(result, law, m)
    busiest = step_of(result, law, m, breaking)[1]
    logarithm = math.log2(math.ceil(1e9 / bonds))
    communication = 12 * latency + sent / bandwidth + 2 * latency * logarithm + copies * packed
    return communication, computing / (busiest + computing * 15 / 9 / m + communication)


def scaling(result):
    """Lines of the docs about weak scaling."""
    sizes = (100, 46, 22)
    time = {f["law"]: f["ns_per_bond_step"] for f in result["bonds"] if f["processors"] == 1}
    packed = step_of(result, "cpm", 22)[4]
    beams = ", ".join(f"{sending(result, 'cohesive_beam', m, 2e-6, 10e9)[1] * 100:.0f}" for m in sizes)
    lines = [
        f"With `t` = {time['cpm']:.0f} ns (cpm) and `p` = {packed * 1e9:.0f} ns; with beams ({time['cohesive_beam']:.0f} ns) the first "
        f"efficiencies are {beams} %.",
        "",
        "| m | processes | bonds each | computing | ghosts | sent per step | 10 GB/s, 2 µs: communication, efficiency | 1 GB/s, 10 µs |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for m in sizes:
        bonds, computing, copies, sent, _ = step_of(result, "cpm", m)
        power = math.floor(math.log10(bonds))
        wires = []
        for latency, bandwidth in ((2e-6, 10e9), (10e-6, 1e9)):
            communication, efficiency = sending(result, "cpm", m, latency, bandwidth)
            wires.append(f"{communication * 1e3:.1f} ms, {efficiency * 100:.0f} %")
        each = f"{bonds / 10**power:.1f}·10{'⁰¹²³⁴⁵⁶⁷⁸⁹'[power]}"
        lines.append(f"| {m} | {math.ceil(1e9 / bonds):,} | {each} | {digits(computing * 1e3)} ms | "
                     f"{copies / m**3 * 100:.0f} % | {digits(sent / 1e6)} MB | {wires[0]} | {wires[1]} |")
    return lines


def blocks(result):
    """Blocks of the docs, each between comment lines that name it."""
    parts = (("cost", cost(result)), ("rebuild", rebuild_cost()), ("weak scaling", scaling(result)))
    return ["\n".join([f"<!-- compare_speed.py: {name} -->", *lines, "<!-- end -->"]) for name, lines in parts]


def check_docs(wanted, results):
    """Exit unless the page of the docs contains these blocks, which show the record `results`."""
    with open(DOCS) as file:
        docs = file.read()
    for block in wanted:
        if block not in docs:
            raise SystemExit(f"docs/book/evidence/liggghts.md does not show {results}; it should contain\n{block}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--memory", action="store_true")
    parser.add_argument("--rebuild", action="store_true")
    parser.add_argument("--docs", action="store_true")
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    if arguments.rebuild:
        load = os.getloadavg()
        with tempfile.TemporaryDirectory() as folder:
            found = list(rebuilds(folder, arguments.rounds))
        save(REBUILDS, circumstances(load) | {"rounds": arguments.rounds, "figures": found})
        return
    if arguments.memory:
        with open(RESULTS) as file:
            result = json.load(file)
        with tempfile.TemporaryDirectory() as folder:
            held = memory_of_bonds(folder)
        for figure in result["bonds"]:
            if figure["processors"] == 1:
                figure["bytes_per_bond"], figure["bytes_per_bond_at_most"] = held[figure["law"]]
        save(RESULTS, result)
    elif not arguments.docs and not arguments.check:
        result = measure(arguments.rounds)
        save(RESULTS, result)
        for name, values in [("ratio of contacts", result["contacts"]["ratios"]),
                             *((f"{f['law']} on {f['processors']}", f["rounds"]) for f in result["bonds"])]:
            print(f"scatter of the median, {name}: {scatter(values) * 100:.1f} %")
    with open(RESULTS) as file:
        wanted = blocks(json.load(file))
    if arguments.check:
        check_docs(wanted, RESULTS)
    else:
        print("\n\n".join(wanted))


if __name__ == "__main__":
    main()
