"""What all pictures share: fonts, colors that color-blind readers tell apart, bodies of spheres, cracks."""

import subprocess
from pathlib import Path

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import EllipseCollection
from PIL import Image

BOOK = Path(__file__).resolve().parents[1]
IMAGES = BOOK / "images"
LIMIT = 200_000  # bytes of one picture

#: Okabe and Ito, without the yellow, which is too light on white.
BLUE, ORANGE, GREEN, RED, PURPLE, SKY = COLORS = ["#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9"]
BODY = "0.87"

plt.rcParams.update({
    "font.size": 11, "axes.titlesize": 11, "axes.spines.top": False, "axes.spines.right": False, "figure.dpi": 110,
    "axes.prop_cycle": matplotlib.cycler(color=COLORS), "legend.frameon": False, "lines.linewidth": 1.8,
})


class Runs:
    """Results of templates, kept in a folder: a template that has run there does not run again."""

    def __init__(self, program, folder):
        self.program, self.folder = program, Path(folder)

    def call(self, *arguments):
        subprocess.run([self.program, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, cwd=self.folder)

    def text(self, template):
        """The scenario of a template."""
        path = self.folder / f"{template}.toml"
        if not path.exists():
            self.call("init", "--template", template, path)
        return path.read_text(encoding="utf-8")

    def template(self, template, name=None, sets=()):
        """The result of a template, with keys changed as by `--set`."""
        self.text(template)
        path = self.folder / f"{name or template}.h5"
        if not path.exists():
            self.call("run", "--quiet", f"{template}.toml", "-o", path, *(word for one in sets for word in ("--set", one)))
        return h5py.File(path)

    def scenario(self, name, text):
        """The result of a scenario."""
        path = self.folder / f"{name}.toml"
        path.write_text(text, encoding="utf-8")
        if not path.with_suffix(".h5").exists():
            self.call("run", "--quiet", path)
        return h5py.File(path.with_suffix(".h5"))


def save(figure, name):
    path = IMAGES / f"{name}.png"
    path.parent.mkdir(exist_ok=True)
    if figure.get_layout_engine() is None:
        figure.tight_layout()
    figure.savefig(path)
    plt.close(figure)
    if path.stat().st_size > LIMIT // 2:
        # 256 colors take a third of the bytes.
        Image.open(path).convert("RGB").quantize(256).save(path, optimize=True)
    assert path.stat().st_size < LIMIT, f"{path} has {path.stat().st_size} bytes"


def sample(result, name):
    return result[f"samples/{name}"][:]


def spheres(axis, result, plane="xz", color=BODY, undeformed=True, mask=None, **more):
    """Spheres as circles of their size in a plane of the axes, mm; `color` is one color, or one number per sphere. Returns the circles."""
    across, up = ("xyz".index(one) for one in plane)
    place = result["particles/position"][:] - (result["particles/displacement"][:] if undeformed else 0)
    depth = ({0, 1, 2} - {across, up}).pop()
    order = np.argsort(place[:, depth])
    if mask is not None:
        order = order[mask[order]]
    diameter = 2e3 * result["particles/radius"][:][order]
    circles = EllipseCollection(diameter, diameter, 0 * diameter, units="xy", offsets=1e3 * place[order][:, [across, up]], transOffset=axis.transData,
                                linewidths=0.4, edgecolors="0.5", **more)
    if isinstance(color, str):
        circles.set_facecolor(color)
    else:
        circles.set_array(np.asarray(color)[order])
    axis.add_collection(circles)
    low, high = 1e3 * place[order].min(0)[[across, up]], 1e3 * place[order].max(0)[[across, up]]
    edge = 0.5 * diameter.max()
    axis.set(aspect="equal", xlim=(low[0] - edge, high[0] + edge), ylim=(low[1] - edge, high[1] + edge),
             xlabel=f"{plane[0]}, mm", ylabel=f"{plane[1]}, mm")
    return circles


def cracks(axis, result, plane="xz", unit="ms", size=9, slice=None):
    """Bonds of the event log, colored by time, over the body; all, or those in a slice of this thickness, mm. Returns their number."""
    spheres(axis, result, plane)
    scale = {"ms": 1e3, "µs": 1e6}[unit]
    columns = ["xyz".index(one) for one in plane]
    place, time = result["events/position"][:] * 1e3, result["events/time"][:] * scale
    if slice:
        near = np.abs(place[:, ({0, 1, 2} - set(columns)).pop()]) < 0.5 * slice
        place, time = place[near], time[near]
    # A bond enters the log twice if it first softens and then breaks.
    points = axis.scatter(place[:, columns[0]], place[:, columns[1]], c=time, s=size, cmap="viridis", zorder=3)
    axis.figure.colorbar(points, ax=axis, label=f"time, {unit}", shrink=0.8)
    return len(place)


def curve(axis, result, sign=1, strain="strain, ‰", stress="stress, MPa", strain_sign=None, **more):
    """Stress over strain; the signs make compression positive, where the labels say so."""
    axis.plot((strain_sign or sign) * sample(result, "strain") * 1e3, sign * sample(result, "stress") / 1e6, **more)
    axis.set(xlabel=strain, ylabel=stress)


def specimen(result, title, plane="xz", unit="ms", sign=1, strain_sign=None, slice=None, events="bonds whose damage passed 0.9", **words):
    """A stress-strain curve, and the cracks behind it."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), width_ratios=(1.2, 1))
    curve(left, result, sign, strain_sign=strain_sign, **words)
    left.set_title(title)
    peak = int(np.argmax(sign * sample(result, "stress")))
    x, y = (strain_sign or sign) * sample(result, "strain")[peak] * 1e3, sign * sample(result, "stress")[peak] / 1e6
    left.plot(x, y, "o", color=RED)
    left.annotate(f"{y:.3g} MPa", (x, y), xytext=(8, -2), textcoords="offset points", color=RED)
    right.set_title(f"{cracks(right, result, plane, unit, slice=slice)} {events}")
    return figure


def rendered(runs, result, name, *options):
    """A picture by `concordem render`."""
    path = runs.folder / f"{name}.png"
    runs.call("render", result.filename, "--force", "--output", path, *options)
    return Image.open(path).convert("RGB")


def beside(images, name, height=520):
    """Pictures of one height, next to each other."""
    fitted = [image.resize((round(image.width * height / image.height), height), Image.LANCZOS) for image in images]
    sheet = Image.new("RGB", (sum(image.width for image in fitted), height), "white")
    left = 0
    for image in fitted:
        sheet.paste(image, (left, 0))
        left += image.width
    path = IMAGES / f"{name}.png"
    sheet.quantize(256).save(path, optimize=True)
    assert path.stat().st_size < LIMIT, f"{path} has {path.stat().st_size} bytes"
