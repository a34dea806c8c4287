"""Pictures of pages that use the Python package, YADE, LIGGGHTS, LAMMPS, or the harness.

They need on the machine what their page needs: the package in this Python, `yade`, `concordem-liggghts`, `lmp`, `concordem-validate`, `chromium`.
"""

import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

import h5py
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from .style import BLUE, BOOK, GREEN, IMAGES, LIMIT, ORANGE, RED, curve, sample, save

ROOT = BOOK.parents[1]
AREA = 15e-3 * 15e-3  # m², of the prism of cpm-small
HEIGHT = 29.943844718621e-3  # m, between its lowest and its highest center; the script of tutorials/in-yade.md moves the ends at rate × HEIGHT


def block(page, start, language):
    """The block of a page that follows a mark."""
    text = (BOOK / page).read_text(encoding="utf-8").split(start, 1)[1]
    return text.split(f"```{language}\n", 1)[1].split("```", 1)[0]


def measure(runs):
    """The samples of how-to/measure.md: the stress in a sphere over the time, and the stress in twelve cells."""
    result = runs.scenario("sampled", block("how-to/measure.md", "file=sampled.toml", "toml"))
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), width_ratios=[1.4, 1], layout="constrained")
    inside = result["samples/region-stress"]
    left.plot(inside["time"][:] * 1e6, inside["stress"][:].reshape(-1, 9)[:, 8] / 1e6, "o-", label="sphere in the middle, radius 5 mm")
    left.plot(sample(result, "time") * 1e6, sample(result, "stress") / 1e6, "--", label="force on the ends / area")
    left.set(xlabel="time, µs", ylabel="stress zz, MPa", title="region-stress")
    left.legend()
    cells = result["samples/stress map/stress"][-1].reshape(3, 2, 2, 9)[:, 0, :, 8] / 1e6
    drawn = right.imshow(cells, origin="lower", extent=(-6, 6, -9, 9), cmap="cividis", aspect="equal")
    for (up, across), value in np.ndenumerate(cells):
        right.text(-3 + 6 * across, -6 + 6 * up, f"{value:.2f}", ha="center", va="center", bbox={"facecolor": "white", "edgecolor": "none", "pad": 2})
    right.set(xlabel="x, mm", ylabel="z, mm", title="stress map, cells with y < 0")
    figure.colorbar(drawn, ax=right, label="stress zz, MPa")
    save(figure, "measure")


def restart(runs):
    """A run, and its continuation to a smaller stress."""
    first = runs.template("cpm-small")
    path = runs.folder / "further.h5"
    if not path.exists():
        (runs.folder / "further.toml").write_text(runs.text("cpm-small").replace("drop_to = 0.2", "drop_to = 0.1"), encoding="utf-8")
        runs.call("run", "--quiet", "further.toml", "--from", "cpm-small.h5", "--output", path)
    figure, axis = plt.subplots(figsize=(6.5, 3.6))
    curve(axis, first, label="first.h5: until 20 % of the peak")
    curve(axis, h5py.File(path), linestyle="--", color=RED, label="further.h5: run --from first.h5, until 10 %")
    axis.legend()
    save(figure, "restart")


def package(runs):
    """What `plot` of the Python package draws, as in how-to/use-python.md."""
    import concordem

    runs.template("cpm-small").close()
    result = concordem.Result(str(runs.folder / "cpm-small.h5"))
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6))
    result.plot(axes=axes[0])
    concordem.plot(result.events, "time", "energy", axes=axes[1], linestyle="none", marker=".", markersize=4)
    axes[0].set_title("simulation.plot()")
    axes[1].set_title('concordem.plot(simulation.events, "time", "energy")', fontsize=9)
    save(figure, "python-plot")


def adhesive(_runs):
    """The law of how-to/law-in-python.md and tutorials/write-a-law.md: force over elongation of two spheres that meet and part."""
    words = {}
    page = (BOOK / "how-to/law-in-python.md").read_text(encoding="utf-8")
    law, use = (part.split("```python\n", 1)[1].split("```", 1)[0] for part in page.split("<!-- code: needs=package -->\n")[1:3])
    exec(law, words)  # the page's own code
    exec(use.split("simulation.run()")[0], words)
    simulation = words["simulation"]
    rows = []
    while simulation.stopped is None:
        simulation.step(20)
        gap = np.diff(simulation.state.positions[:, 0])[0] - 2e-3
        rows.append((simulation.state.time, gap, simulation.forces().contacts.force[:, 0].sum(), np.diff(simulation.state.velocities[:, 0])[0]))
    time, gap, force, speed = np.array(rows).T
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6))
    meets = time <= time[np.argmin(gap)]
    left.plot(gap[meets] * 1e6, force[meets] * 1e3, color=BLUE, label="the spheres approach")
    left.plot(gap[~meets] * 1e6, force[~meets] * 1e3, "--", color=ORANGE, label="and part")
    left.axhline(20, color="0.5", linewidth=1, linestyle=":")
    left.annotate("pull-off force 20 mN", (gap.min() * 1e6, 20), xytext=(0, 4), textcoords="offset points", color="0.35")
    left.set(xlabel="elongation u, µm (negative: overlap)", ylabel="force, mN (tension positive)", ylim=(None, 34))
    left.legend(loc="lower right")
    right.plot(time * 1e6, speed)
    right.axhline(np.sqrt(0.1**2 - 0.02**2 / 1e4 / (simulation.state.masses[0] / 2)), color=RED, linewidth=1.2, linestyle="--", label="closed form")
    right.set(xlabel="time, µs", ylabel="relative velocity, m/s")
    right.legend()
    save(figure, "adhesive")


def calibrated(runs):
    """Elastic constants of a cell before and after `calibrate elastic`, by four methods."""
    runs.text("cpm-periodic")
    wanted = runs.folder / "wanted.toml"
    if not wanted.exists():
        runs.call("calibrate", "elastic", "cpm-periodic.toml", "--young", "30 GPa", "--poisson", "0.2", "--output", wanted)
    names = ["closed form", "affine sum", "static network", "relaxed dynamics"]
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.2), sharey=True)
    for scenario, label, mark, color in ("cpm-periodic.toml", "template", "o", ORANGE), ("wanted.toml", "calibrated", "s", BLUE):
        printed = subprocess.run([runs.program, "elastic", scenario], check=True, text=True, capture_output=True, cwd=runs.folder).stdout
        rows = [next(line for line in printed.splitlines() if line.strip().startswith(name)) for name in names]
        # E and ν are the first two of the five numbers at the end of a row.
        values = np.array([[float(word) for word in re.findall(r"\d+\.\d+", row)[:2]] for row in rows])
        for axis, column in zip(axes, values.T, strict=True):
            axis.plot(column, range(len(names)), mark, color=color, markersize=8, label=label)
    for axis, target, label in (axes[0], 30, "E, GPa"), (axes[1], 0.2, "Poisson's ratio"):
        axis.axvline(target, color="0.3", linewidth=1.2, linestyle="--", label="target")
        axis.set(xlabel=label, ylim=(3.5, -0.5))
    axes[0].set_yticks(range(len(names)), names)
    axes[1].legend(loc="center left", bbox_to_anchor=(1, 0.5))
    save(figure, "calibrated")


def host_run(runs, name, script, command, environment=None):
    """Runs a script of a host in a folder with more output; returns the thermo rows, and ids and midpoints of the bonds that broke, mm."""
    folder = runs.folder / name
    if not (folder / "atoms.1000.txt").exists():
        folder.mkdir(exist_ok=True)
        text = (ROOT / "liggghts-bridge/examples" / script).read_text(encoding="utf-8")
        text = text.replace("thermo          100", "thermo          20").replace("run             1000", "dump atoms all custom 500 atoms.*.txt id x y z\nrun 1000")
        (folder / script).write_text(text, encoding="utf-8")
        subprocess.run([*command, script], check=True, cwd=folder, stdout=subprocess.DEVNULL, env={**os.environ, **(environment or {})})
    log = next(folder.glob("log.*")).read_text(encoding="utf-8").splitlines()
    head = next(at for at, line in enumerate(log) if line.split()[:1] == ["Step"])
    rows = np.array([line.split() for line in log[head + 1 :][:51]], dtype=float)
    table = lambda file: np.loadtxt(folder / file, skiprows=9, ndmin=2)
    pairs = [{tuple(sorted(row[:2].astype(int))) for row in table(f"bonds.{step}.txt")} for step in (500, 1000)]
    atoms = {int(row[0]): row[1:] * 1e3 for row in table("atoms.500.txt")}
    broken = np.array([(atoms[a] + atoms[b]) / 2 for a, b in sorted(pairs[0] - pairs[1])])
    return rows, broken, np.array(list(atoms.values()))


def hosts(runs):
    """The bar of tutorials/in-liggghts-lammps.md: broken bonds and dissipation in both programs, and where the bar breaks."""
    liggghts, broken, atoms = host_run(runs, "liggghts", "tension.in", ["concordem-liggghts"])
    lammps, _, _ = host_run(runs, "lammps", "tension-lammps.in", ["lmp", "-in"])
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.8), width_ratios=[1.6, 1])
    apart = lambda rows: rows[:, 0] * 8e-7 * 0.1 * 1e6  # the ends part at 0.1 m/s
    left.plot(apart(liggghts), liggghts[:, 4], color=BLUE, label="LIGGGHTS")
    left.plot(apart(lammps), lammps[:, 5], "o", color=ORANGE, markersize=4, label="LAMMPS")
    left.set(xlabel="elongation of the bar, µm", ylabel="energy dissipated by damage, J")
    left.legend()
    right.scatter(atoms[:, 0], atoms[:, 2], s=20, color="0.85", edgecolors="0.6", linewidths=0.4, label="spheres")
    right.scatter(broken[:, 0], broken[:, 2], s=12, color=RED, label="broken bonds")
    right.set(aspect="equal", xlabel="x, mm", ylabel="z, mm", title=f"{len(broken)} bonds broke")
    right.legend(loc="upper left", bbox_to_anchor=(1, 1))
    save(figure, "hosts")


RECORD = """
import json, os, time
top = [b.id for b in O.bodies if b.state.blockedDOFs and b.state.pos[2] > 0]
mean, rows, began = (lambda: sum(O.bodies[i].state.displ()[2] for i in top) / len(top)), [], time.time()
while O.iter < 12000:
    O.run(100, True)
    rows.append((2 * mean(), -sum(O.forces.f(i)[2] for i in top)))
json.dump({"rows": rows, "seconds": time.time() - began}, open("NAME.json", "w"))
os._exit(0)
"""


def yade_run(runs, name, hand_over=""):
    """The script of tutorials/in-yade.md, with a record every 100 steps: rows of elongation (m) and force (N)."""
    path = runs.folder / f"{name}.json"
    if not path.exists():
        runs.text("cpm-small")
        runs.call("pack", "cpm-small.toml", "--output", "spheres.txt")
        script = block("tutorials/in-yade.md", "needs=yade", "python") + hand_over + RECORD.replace("NAME", name)
        (runs.folder / f"{name}.py").write_text(script, encoding="utf-8")
        subprocess.run(["yade", "-n", "-x", "-j1", f"{name}.py"], check=True, cwd=runs.folder, stdout=subprocess.DEVNULL)
    return np.array(json.loads(path.read_text(encoding="utf-8"))["rows"])


def force_curve(axis, rows, style, **words):
    axis.plot(rows[:, 0] * 1e6, rows[:, 1] / 1e3, style, **words)
    axis.set(xlabel="elongation between the ends, µm", ylabel="force on an end, kN")


def in_yade(runs):
    """The script of tutorials/in-yade.md in stock YADE and after the hand-over."""
    figure, axis = plt.subplots(figsize=(6.5, 3.6))
    force_curve(axis, yade_run(runs, "stock"), "-", color=BLUE, label="stock YADE")
    handed = yade_run(runs, "handed", "import concordem.yade\nengine = concordem.yade.take_over(update_states=1000)\n")
    force_curve(axis, handed[::3], "o", color=ORANGE, markersize=4, label="after take_over()")
    axis.legend()
    save(figure, "in-yade")


def beside_yade(runs):
    """The same specimen in YADE and in the program, as how-to/compare-with-yade.md says."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6))
    stock = yade_run(runs, "stock")
    result = runs.template("cpm-small", "yade-public", [
        "kinematics=yade-ratcheting", "material[0].cpm.mode=yade-public", "integration.time_step=2e-7",
        "loading.layer_thickness=5 mm", f"loading.gauge_length={HEIGHT}",  # the ends of that script
    ])
    own = np.column_stack([sample(result, "strain") * HEIGHT, sample(result, "stress") * AREA])
    for axis in left, right:
        force_curve(axis, stock, "-", color=BLUE, label="YADE")
        force_curve(axis, own, "--", color=ORANGE, label="ConcorDEM, yade-public")
    left.legend()
    left.set_title("whole test")
    right.set(xlim=(0, 8), title="up to the peak")
    save(figure, "beside-yade")


def validate(runs, folder, *words):
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "validation"), "CONCORDEM": str(runs.program)}
    subprocess.run([sys.executable, "-m", "concordem_validate", *words], check=False, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def screenshot(page, name, width, height):
    """A page in a browser without a window."""
    path = IMAGES / f"{name}.png"
    subprocess.run(["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", f"--window-size={width},{height}",
                    "--virtual-time-budget=4000", f"--screenshot={path}", page], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    Image.open(path).convert("RGB").quantize(64).save(path, optimize=True)
    assert path.stat().st_size < LIMIT, f"{path} has {path.stat().st_size} bytes"


def collision(runs):
    """The case of tutorials/test-your-own-code.md, and the same with a spring that is one percent too stiff."""
    cases = runs.folder / "my-cases"
    if not cases.exists():
        validate(runs, runs.folder, "init", "my-cases")
    mine = (cases / "mine.py").read_text(encoding="utf-8")
    found = {}
    for name, text in ("k", mine), ("1.01 k", mine.replace('k = law["normal_stiffness"]', 'k = 1.01 * law["normal_stiffness"]')):
        (cases / "mine.py").write_text(text, encoding="utf-8")
        shutil.rmtree(cases / "concordem-validate", ignore_errors=True)
        validate(runs, cases, "run")
        report = cases / "concordem-validate/report.html"
        for engine in "mine", "yade":
            with h5py.File(next((cases / "concordem-validate/runs").glob(f"collision.main.{engine}.*.h5"))) as file:
                series = file["series/position"]
                found[name, engine] = series["time"][:], series["values"][:, :, 0]
    (cases / "mine.py").write_text(mine, encoding="utf-8")
    # The report of the second round, without the line about the machine.
    shown = cases / "shown.html"
    shown.write_text(re.sub(r">[^<>]*Linux-[^<>]*<", "><", report.read_text(encoding="utf-8")), encoding="utf-8")
    screenshot(shown.as_uri(), "harness-report", 1100, 470)
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6))
    for particle, color in (0, BLUE), (1, ORANGE):
        for engine, style in ("mine", "-"), ("yade", "k:"):
            time, place = found["k", engine]
            words = {"color": color} if engine == "mine" else {}
            left.plot(time * 1e3, place[:, particle] * 1e3, style, **words, label=f"sphere {particle}" if engine == "mine" else "YADE" if particle else None)
    left.set(xlabel="time, ms", ylabel="x, mm", title="positions by mine.py, and by YADE")
    left.legend()
    for name, color, style in ("k", GREEN, "-"), ("1.01 k", RED, "--"):
        time, place = found[name, "mine"]
        difference = np.abs(place - found[name, "yade"][1]).max(axis=1) / 1e-3
        right.semilogy(time * 1e3, np.maximum(difference, 1e-14), style, color=color, label=f"spring {name}" + (": none (drawn at 1e-14)" if name == "k" else ""))
    right.axhline(1e-10, color="0.4", linewidth=1.2, linestyle=":", label="allowed, 1e-10")
    right.set(xlabel="time, ms", ylabel="difference / displacement of 1 mm", ylim=(5e-15, 10))
    right.legend()
    save(figure, "collision")


def posterior(_runs):
    """The example of tutorials/from-a-curve-to-a-posterior.md with the ensemble of the tests: 40 points, four packings."""
    from concordem import inference

    root = BOOK.parents[1]
    ensemble = inference.Ensemble.load(root / "rust-core/python/tests/data/bars.npz")
    found = inference.posterior(ensemble, inference.Curve.from_csv(BOOK / "data/tension.csv"), noise="0.08 MPa")
    corner = found.plot()
    figure, axes = plt.subplots(figsize=(5.6, 4.6), layout="constrained")
    found.plot_predictive(axes=axes)
    images = []
    for one in (corner, figure):
        buffer = io.BytesIO()
        one.savefig(buffer, dpi=90, format="png")
        plt.close(one)
        images.append(Image.open(buffer).convert("RGB"))
    whole = Image.new("RGB", (sum(one.width for one in images), max(one.height for one in images)), "white")
    whole.paste(images[0], (0, 0))
    whole.paste(images[1], (images[0].width, (whole.height - images[1].height) // 2))
    whole.quantize(128).save(IMAGES / "posterior.png", optimize=True)


def strain_paths(_runs):
    """Paths and the surrogate of how-to/learn-from-cells.md: stress over strain of one path of each kind, and what the surrogate gives."""
    words, before = {}, os.getcwd()
    page = (BOOK / "how-to/learn-from-cells.md").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for block in page.split("```python\n")[1:]:
                exec(block.split("```")[0], words)
        finally:
            os.chdir(before)
    data, kinds = words["data"], words["datasets"].KINDS
    figure, axes = plt.subplots(1, 3, figsize=(9.5, 3.2), sharey=True)
    for kind, axis in enumerate(axes):
        row = words["tested"][data["kind"][words["tested"]] == kind][0]
        axis.plot(1e3 * data["strain"][row, :, 2], data["stress"][row, :, 2] / 1e6, ".-", label="cell")
        guess = words["surrogate"].predict(words["inputs"](row))[:, 2]
        axis.plot(1e3 * data["strain"][row, 1:, 2], guess / 1e6, "--", color=ORANGE, label="surrogate")
        axis.set(title=kinds[kind], xlabel="strain 33, 1e-3")
    axes[0].set_ylabel("stress 33, MPa")
    axes[0].legend()
    save(figure, "strain-paths")


PICTURES = {
    "posterior": posterior,
    "strain-paths": strain_paths,
    "measure": measure,
    "restart": restart,
    "python-plot": package,
    "adhesive": adhesive,
    "calibrated": calibrated,
    "hosts": hosts,
    "in-yade": in_yade,
    "beside-yade": beside_yade,
    "collision": collision,
}
