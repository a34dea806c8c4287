"""Commit and processor of recorded results. The commit is that of the program that computed them, not that of the source tree."""
import platform
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]


def processor(description=Path("/proc/cpuinfo")):
    """Model of the processor and the widest vectors that it has. Virtual machines hide the model: "AMD EPYC" is any of five."""
    try:
        text = description.read_text()
    except OSError:
        return platform.machine()
    entries = dict(re.findall(r"(?m)^([^\t:]+?)\s*: ?(.*)$", text))
    name = entries.get("model name", platform.machine())
    number = [f"{key.removeprefix('cpu ')} {entries[key]}" for key in ("cpu family", "model") if key in entries]
    flags = entries.get("flags", "").split()
    widest = next((label for flag, label in (("avx512f", "AVX-512"), ("avx2", "AVX2")) if flag in flags), None)
    details = ", ".join([*number, *([widest] if widest else [])])
    return f"{name} ({details})" if details else name


def of_tree():
    """Commit of the sources, with `+changes` if they differ from it. Results that a study writes do not count."""
    git = lambda *words: subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!validation/results")
    return git("rev-parse", "HEAD") + ("+changes" if changed else "")


def of_program(program):
    """Commit that the program writes to its results, found by a run of two spheres."""
    with tempfile.TemporaryDirectory() as folder:
        scenario = Path(folder) / "two.toml"
        said = ""
        for words in (["init", "--template", "hertz-impact", scenario], ["run", "--quiet", scenario],
                      ["info", scenario.with_suffix(".h5")]):
            said = subprocess.run([program, *words], capture_output=True, text=True, check=True).stdout
    return re.search(r"(?m)^ *commit +(\S+)$", said)[1]


def label(program):
    """Commit of the program; exits with a message if the program was not built from this tree."""
    commit, tree = of_program(program), of_tree()
    if commit.removesuffix("+changes") != tree.removesuffix("+changes"):
        sys.exit(f"{program} was built as commit {commit}, but the tree is at {tree}, so recorded results would have a wrong commit; rebuild "
                 "it without the variable CONCORDEM_COMMIT: cargo build --release -p concordem")
    return commit
