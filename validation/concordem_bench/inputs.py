"""Inputs of all programs: packings as text files."""
import itertools
import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "target/release/concordem"
GOLD = ROOT / "tests/golden/yade/packing.txt"


def specimen(folder, quick):
    """The concrete cube of the harness, 18,699 spheres; with `quick`, the prism of the gold data, 1,160 spheres."""
    if quick:
        return GOLD
    path = folder / "specimen.txt"
    if not path.exists():
        scenario = shutil.copy(ROOT / "validation/scenarios/specimen-tension.toml", folder)
        subprocess.run([PROGRAM, "pack", "--quiet", "--force", "--output", path, scenario], check=True)
    return path


def lattice(folder, edge, spacing, radius, periodic):
    """A cubic lattice of `edge`³ spheres, x first."""
    path = folder / f"lattice-{edge}-{spacing}-{'periodic' if periodic else 'open'}.txt"
    size = edge * spacing
    lines = [f"##PERIODIC:: {size!r} {size!r} {size!r}"] if periodic else []
    for z, y, x in itertools.product(range(edge), repeat=3):
        lines.append(f"{x * spacing!r} {y * spacing!r} {z * spacing!r} {radius!r}")
    path.write_text("\n".join(lines) + "\n")
    return path


def velocities(count, speed):
    """As `--shake` of the example `speed`: velocities of the spheres in the order of the file, m/s."""
    for k in range(count):
        yield [((k * a) % 1009 / 1009 - 0.5) * 2 * speed for a in (7919, 104729, 1299709)]
