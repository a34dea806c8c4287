#!/usr/bin/env bash
# check.sh FOLDER PYTHON WORK: installs FOLDER/packages/concordem-*.whl into a new virtual environment of PYTHON, without network, and
# works with it in the folder WORK. H5PY=prefix: h5py and NumPy are those of PYTHON, as in conda.
set -euo pipefail
folder=$1 python=$2 work=$3
mkdir -p "$work"
if [ "${H5PY:-}" = prefix ]; then
  "$python" -m venv --system-site-packages "$work/venv"
  wanted=(concordem)
else
  "$python" -m venv "$work/venv"
  wanted=(concordem h5py)
fi
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-index --find-links "$folder/packages" "${wanted[@]}"
"$work/venv/bin/python" -c 'import sys, numpy, concordem; print("Python", sys.version.split()[0], "NumPy", numpy.__version__, concordem.__file__)'
bash "$folder/program.sh" "$work/venv/bin/concordem" "$work/program"
for first in concordem h5py; do
  "$work/venv/bin/python" "$folder/beside_h5py.py" "$first" "$work/program/first.h5" "$work/$first.h5"
done
# What `python3 -m concordem.yade build` compiles and links.
"$work/venv/bin/python" - <<'END'
from concordem.yade import _native

for part in ("libconcordem_yade.a", "abi.h", "bonds.cpp", "laws.cpp", "classes.txt"):
    assert (_native.staged() / part).stat().st_size > 0, part
END
