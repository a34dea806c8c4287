#!/usr/bin/env python3
"""A thousand runs of a thousand particles: two threads beside one, time beyond the runs' own, twenty kills.

    validation/ensembles.py [--full | --table]

`concordem sweep` varies three parameters of a concrete prism in tension. Blocks of runs are timed with one thread, with two, and as the Python
package runs them, two processes side by side: the sum of those times is the runs' own time. Then a thousand runs are computed at once, and
again with twenty kills at random moments; result, page, and table must have the same bytes. Results are written to
validation/results/ensembles.json after each of these. Without --full, a few runs are killed with the same code, and the figures on record
are checked.
"""

import hashlib
import random
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from concordem_validate import scenario, study as studies

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/concordem"
RESULTS = ROOT / "validation/results/ensembles.json"

# The template has a prism of some thousand particles. With this fast loading a run takes half a second.
SPECIMEN = {"packing": {"kind": "file", "path": "spheres.txt"}, "loading.strain_rate": "2 1/s", "output": {"sample_interval": 10}}
RANGES = {"young": (20e9, 30e9), "crack_onset_strain": (8e-5, 1.2e-4), "relative_ductility": (10.0, 40.0)}
# Strain at the end, a little behind the peak, and where the reduced case ends.
END, EARLY = 6e-4, 2e-4
# Runs of a block, and blocks. At the end one thread waits for the other by half a run on average: 0.2 % of three hundred runs.
RUNS, BLOCKS = 300, 2
ALL, KILLS = 1000, 20


def sweep_file(folder, count, seed, end=END):
    """Writes spheres, scenario, and sweep of `count` samples; returns the sweep."""
    import concordem

    if not (folder / "prism.toml").exists():
        # From a file, so that no run makes the packing again.
        concordem.packing.write(folder / "spheres.txt", *concordem.Scenario.template("cpm-small").pack())
        text = (ROOT / "rust-core/scenario/src/schema/templates/cpm-small.toml").read_text()
        (folder / "prism.toml").write_text(scenario.dumps(scenario.changed(tomllib.loads(text), SPECIMEN | {"stop": {"strain": end}})))
    axes = [{"name": name, "key": f"material[0].cpm.{name}", "linear": {"from": low, "to": high}} for name, (low, high) in RANGES.items()]
    sweep = {"version": 1, "scenario": "prism.toml", "study": "run", "results": ["E", "f_t"], "axis": axes,
             "sampling": {"method": "sobol", "count": count, "seed": seed},
             "curve": [{"x": "strain", "y": "stress", "from": 0, "to": 5e-4, "count": 51}]}
    path = folder / f"sweep-{seed}.toml"
    path.write_text(scenario.dumps(sweep))
    return path


def command(program, sweep, threads, name):
    return [program, "sweep", sweep, "-q", "--csv", "-j", str(threads), "-o", sweep.with_name(f"{name}.h5")]


def timed(program, sweep, threads):
    name = f"{sweep.stem}-{threads}"
    begin = time.perf_counter()
    subprocess.run(command(program, sweep, threads, name), check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begin, digests(sweep.with_name(name))


def digests(path):
    """What a sweep has written: result, page, table."""
    return [hashlib.sha256(path.with_suffix(suffix).read_bytes()).hexdigest() for suffix in (".h5", ".html", ".csv")]


def own_time(folder, rows):
    """Seconds of these runs, one after the other; and particles of the specimen."""
    import concordem

    prism = concordem.Scenario.from_file(folder / "prism.toml")
    particles = len(prism.simulation(threads=1, snapshots=False).state.positions)
    seconds = 0.0
    for row in rows:
        settings = {f"material[0].cpm.{name}": float(value) for name, value in zip(RANGES, row, strict=True)}
        begin = time.perf_counter()
        prism.with_settings(settings).simulation(threads=1, snapshots=False).run()
        seconds += time.perf_counter() - begin
    return seconds, particles


def samples(path):
    """The values of the parameters at each point of a result."""
    import h5py

    with h5py.File(path) as file:
        return list(zip(*(file[f"axes/{k} {name}"][()] for k, name in enumerate(RANGES)), strict=True))


def block(program, folder, count, seed):
    """Times of a block of runs."""
    sweep = sweep_file(folder, count, seed)
    one, first = timed(program, sweep, 1)
    two, second = timed(program, sweep, 2)
    rows = samples(sweep.with_name(f"{sweep.stem}-1.h5"))
    with ProcessPoolExecutor(2) as pool:
        halves = list(pool.map(partial(own_time, folder), (rows[::2], rows[1::2])))
    own = sum(seconds for seconds, _ in halves)
    return {"runs": count, "particles": halves[0][1], "one_thread_s": one, "two_threads_s": two, "own_s": own, "ratio": one / two,
            "overhead": 2 * two / own - 1, "equal_bytes": first == second}


def killed(program, sweep, kills, length):
    """Runs a sweep, ended `kills` times by SIGKILL at random moments of its expected length (s), to its end; returns where it was killed."""
    moments = random.Random(1)
    known, journal = [], sweep.with_name("killed.h5.points")
    while len(known) < kills:
        process = subprocess.Popen(command(program, sweep, 2, "killed"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            process.wait(moments.uniform(0.0, 2 * length / (kills + 1)))
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
        if process.wait() != -signal.SIGKILL:
            raise SystemExit(f"ensembles.py: the sweep ended after {len(known)} of {kills} kills")
        # The first line is no point.
        known.append(max(journal.read_bytes().count(b"\n") - 1, 0) if journal.exists() else 0)
    subprocess.run(command(program, sweep, 2, "killed"), check=True, stdout=subprocess.DEVNULL)
    return known


def whole(program, folder, count, kills, end=END):
    """A sweep in one go, and the same with kills."""
    sweep = sweep_file(folder, count, 100, end)
    seconds, expected = timed(program, sweep, 2)
    begin = time.perf_counter()
    # Half of the length: what runs at a kill is lost, and the sweep must not end before the last one.
    known = killed(program, sweep, kills, seconds / 2)
    again = time.perf_counter() - begin
    return {"runs": count, "two_threads_s": seconds, "killed_s": again, "points_at_kills": known,
            "equal_bytes": digests(sweep.with_name("killed")) == expected}


def full(known, save, about, program, options):
    for name, work in [(f"block {seed}", partial(block, program, count=RUNS, seed=seed)) for seed in range(1, BLOCKS + 1)] + [
        ("killed", partial(whole, program, count=ALL, kills=KILLS))
    ]:
        if name not in known:
            with tempfile.TemporaryDirectory() as folder:
                known[name] = work(folder=Path(folder)) | about
            save()
            print(f"{name}: {known[name]}", flush=True)


def reduced(known, save, about, program, options):
    with tempfile.TemporaryDirectory() as folder:
        known["reduced"] = whole(program, Path(folder), 12, 3, EARLY) | about


def check_reduced(found, known):
    return [] if found["reduced"]["equal_bytes"] else [f"killed and resumed, the files differ: {found['reduced']}"]


def check_record(known):
    """Statements of the book about the values on record that do not hold, as messages."""
    names = [*(f"block {seed}" for seed in range(1, BLOCKS + 1)), "killed"]
    if missing := [name for name in names if name not in known]:
        return [f"not on record: {', '.join(missing)}; run validation/ensembles.py --full"]
    wrong = [f"{name}: the files differ" for name in names if not known[name]["equal_bytes"]]
    for name in names[:-1]:
        found = known[name]
        if found["ratio"] < 1.9 or found["overhead"] > 0.05:
            wrong.append(f"{name}: {found['ratio']:.3f} times one thread, {found['overhead']:.1%} beyond the runs' own time")
    if len(known["killed"]["points_at_kills"]) != KILLS:
        wrong.append(f"{len(known['killed']['points_at_kills'])} kills")
    return wrong


def table(known):
    """The figures on record, as rows of the table in docs/book/evidence/inference.md."""
    for name, found in known.items():
        if "ratio" in found:
            print(f"| {name}: {found['runs']} runs of {found['particles']} particles | {found['one_thread_s']:.1f} | {found['two_threads_s']:.1f} | "
                  f"{found['own_s']:.1f} | {found['ratio']:.2f} | {found['overhead']:.1%} |")
        elif name == "killed":
            print(f"{found['runs']} runs: {found['two_threads_s']:.0f} s; with kills at {found['points_at_kills']} points {found['killed_s']:.0f} s; equal bytes: "
                  f"{found['equal_bytes']}")


if __name__ == "__main__":
    studies.run(__file__, __doc__, PROGRAM, RESULTS, full=full, reduced=reduced, check_reduced=check_reduced, check_record=check_record,
                table=table)
