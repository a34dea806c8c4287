#!/usr/bin/env bash
# Opens exports as users do, in pyvista, OVITO, and ParaView: a specimen that breaks, a sheared periodic cell, and discs in a plane.
#   tests/viewers/run.sh            all
#   tests/viewers/run.sh PROGRAM... pyvista, ovito, paraview
# pyvista and OVITO come from pip, into target/viewers/venv (1.4 GB). ParaView runs in a Debian 13 of its own (2 GB; needs root), because
# that of Debian 12 is too old for VTKHDF with time steps. Pictures are in target/viewers.
set -euo pipefail
cd "$(dirname "$0")/../.."
here=tests/viewers
program=$PWD/target/release/concordem
out=$PWD/target/viewers
mkdir -p "$out"
"$out/venv/bin/python" -c 'import pyvista, ovito, h5py' 2>/dev/null || {
  python3 -m venv "$out/venv"
  "$out/venv/bin/pip" install --quiet --disable-pip-version-check pyvista ovito h5py
}
rm -rf "$out/files"
mkdir -p "$out/files"
cp "$here"/*.py "$here"/*.toml "$out/files/"
(
  cd "$out/files"
  for name in breaking sheared discs; do
    "$program" run --quiet "$name.toml"
    "$program" export "$name.h5" >/dev/null
    "$program" export "$name.h5" --format lammps >/dev/null
  done
)
[ $# -gt 0 ] || set -- pyvista ovito paraview
for viewer in "$@"; do
  case $viewer in
    pyvista) (cd "$out/files" && "$out/venv/bin/python" in_pyvista.py breaking sheared discs) ;;
    ovito)
      (
        cd "$out/files"
        for name in breaking sheared discs; do
          "$out/venv/bin/python" "$name.ovito.py"
        done
        "$out/venv/bin/python" in_ovito.py breaking sheared discs
      )
      ;;
    paraview)
      export BARE=trixie WITH="paraview python3-paraview xvfb xauth"
      yade-bridge/tests/native/chroot.sh make
      for name in breaking sheared discs; do
        yade-bridge/tests/native/chroot.sh run "$out/files" sh -c "cd /mnt && xvfb-run --auto-servernum pvpython in_paraview.py $name"
      done
      ;;
    *) echo "run.sh: unknown viewer $viewer" >&2; exit 2 ;;
  esac
  echo "$viewer: passed"
done
cp "$out"/files/*.png "$out/" 2>/dev/null || true
