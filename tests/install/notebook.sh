#!/usr/bin/env bash
# notebook.sh WORK WHEEL BOOK: what another team does with the package. WORK is a new folder; WHEEL is installed into a new virtual environment there;
# BOOK is docs/book. Jupyter runs outside.ipynb and the notebooks of the book, each in an empty folder; then every page of the book with Python code
# runs word for word. Needs a network for pip.
set -euo pipefail
work=$1 wheel=$2 book=$3
here=$(cd "$(dirname "$0")" && pwd)
bin=$work/venv/bin
fail() { echo "notebook.sh: $*" >&2; exit 1; }
# Nothing of the sources, and no package that was installed elsewhere.
unset PYTHONPATH
export PIP_DISABLE_PIP_VERSION_CHECK=1 PYTHONNOUSERSITE=1 MPLBACKEND=Agg
python3 -m venv "$work/venv"
# As the pages say: the wheel, and beside it what a reader of the book uses. jsonschema and tomli-w are those of run_code_blocks.py.
"$bin/pip" install --quiet "$wheel" nbclient ipykernel h5py matplotlib pandas xarray scikit-fem mypy jsonschema tomli-w
export PATH=$bin:$PATH

for notebook in "$here/outside.ipynb" "$book"/notebooks/*.ipynb; do
  folder=$work/$(basename "$notebook" .ipynb)
  mkdir "$folder"
  cp "$notebook" "$folder/notebook.ipynb"
  started=$SECONDS
  (cd "$folder" && jupyter execute --inplace notebook.ipynb >log.txt 2>&1) || { tail -n 40 "$folder/log.txt" >&2; fail "$(basename "$notebook") fails"; }
  echo "$(basename "$notebook"): $((SECONDS - started)) s"
done
# The cells gave what the book shows.
(cd "$work" && python "$book/run_notebooks.py")

# Completion in editors comes from the types, which the wheel has: mypy accepts the cells, and finds a key that is misspelled.
python - "$here/outside.ipynb" "$work/typed.py" "$work/misspelled.py" <<'END'
import json, sys

cells = json.load(open(sys.argv[1], encoding="utf-8"))["cells"]
text = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code") + "\n"
assert text.count("shear_strength=") == 1
open(sys.argv[2], "w", encoding="utf-8").write(text)
open(sys.argv[3], "w", encoding="utf-8").write(text.replace("shear_strength=", "shear_strenght="))
END
(cd "$work" && python -m mypy --check-untyped-defs --ignore-missing-imports typed.py) || fail "the cells do not fit the types"
code=0; (cd "$work" && python -m mypy --check-untyped-defs --ignore-missing-imports misspelled.py >mypy.txt) || code=$?
[ $code = 1 ] && grep -q 'shear_strenght' "$work/mypy.txt" || fail "a misspelled key has no error of its type: $(cat "$work/mypy.txt")"

mapfile -t pages < <(grep -rl '^```python' "$book" --include='*.md' --exclude-dir=_build --exclude-dir=generated | sort)
(cd "$work" && python "$book/run_code_blocks.py" --package --verbose --concordem "$bin/concordem" "${pages[@]}")
