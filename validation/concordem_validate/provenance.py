"""Which commit a figure on record belongs to: that of the program that made it, not that of the tree it was found in."""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]


def of_tree():
    """Commit of the sources, with `+changes` if they are not as committed; results that a study writes are not sources."""
    git = lambda *words: subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!validation/results")
    return git("rev-parse", "HEAD") + ("+changes" if changed else "")


def of_program(program):
    """Commit that the program writes into its results; it takes a run of two spheres to know."""
    with tempfile.TemporaryDirectory() as folder:
        scenario = Path(folder) / "two.toml"
        said = ""
        for words in (["init", "--template", "hertz-impact", scenario], ["run", "--quiet", scenario],
                      ["info", scenario.with_suffix(".h5")]):
            said = subprocess.run([program, *words], capture_output=True, text=True, check=True).stdout
    return re.search(r"(?m)^ *commit +(\S+)$", said)[1]


def label(program):
    """Commit for figures that the program makes; ends with a message where the program is not of this tree."""
    commit, tree = of_program(program), of_tree()
    if commit.removesuffix("+changes") != tree.removesuffix("+changes"):
        sys.exit(f"{program} was built as commit {commit}, the tree is at {tree}: figures on record would bear a wrong label. "
                 "Build it anew, without the variable CONCORDEM_COMMIT: cargo build --release -p concordem")
    return commit
