#!/usr/bin/env bash
# "One law is one file and one line": the laws of the tutorial "Write your own law", in a copy of the sources, in every host.
#   tests/new_law/run.sh        needs what `make test` needs; keeps the copy and what it built in target/new-law
set -euo pipefail
cd "$(dirname "$0")/../.."
here=$PWD/tests/new_law
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
unset CARGO_TARGET_DIR
root=$target/new-law
tree=$root/tree
python=$PWD/.venv/bin/python
"$python" "$here/scratch.py" "$PWD" "$tree"
# Dependencies that are compiled already.
if [ ! -d "$tree/target" ] && [ -d "$target/release" ]; then
  mkdir "$tree/target"
  cp -a "$target/release" "$tree/target/"
fi
cd "$tree"
cargo=${CARGO:-cargo}
started=$SECONDS
# The law files themselves: formatted, and with the conformance tests that the tutorial asks for.
rustfmt --edition 2024 --check rust-core/contact/src/law/{adhesive,hinge}.rs
$cargo test --quiet --release -p concordem-contact --lib -- law::adhesive law::hinge | tee "$root/conformance.txt"
grep -q '3 passed' "$root/conformance.txt"
# As the tutorial says.
liggghts-bridge/build
liggghts-bridge/lammps/build
yade-bridge/native/build
# The package without a wheel, which would compile HDF5.
$cargo build --release -p concordem-module
rm -rf "$root/site"
mkdir "$root/site"
cp -rL rust-core/python/python/concordem "$root/site/"
cp target/release/lib_core.so "$root/site/concordem/_core.abi3.so"
# The program of the package, which is the program: another one would compile everything again.
printf '#!/bin/sh\nPYTHONPATH=%q exec %q -m concordem "$@"\n' "$root/site" "$python" >"$root/concordem"
chmod +x "$root/concordem"
export CONCORDEM=$root/concordem
echo "built in $((SECONDS - started)) s"
started=$SECONDS
"$python" "$here/hosts.py" "$tree" "$root"
"$python" "$here/speed.py" "$tree" "$root/speed"
CI=1 PYTHONPATH=validation:$root/site "$python" -m concordem_validate run --verbose --fresh --output "$root/validate" new-adhesion new-hinge
# Native functors of YADE, whose classes are generated from the laws, in the Debian 13 of yade-bridge/tests/native.
chroot=$tree/yade-bridge/tests/native/chroot.sh
if [ "$(id -u)" != 0 ]; then
  echo "the native functors of YADE were NOT tested: their Debian 13 needs root; run $0 as root" >&2
  [ -z "${CI:-}" ] || exit 1
else
  "$chroot" make
  shared=$root/debian-13
  rm -rf "$shared"
  mkdir -p "$shared/lib"
  cp -r "$root/site" "$shared/site"
  cp "$here"/*.py pull.toml "$shared/"
  # The package is made on Debian 12 and asks for its HDF5, which Debian 13 has in another version.
  cp -L "$(ldconfig -p | sed -n 's/.*libhdf5_serial\.so\.103 .*=> //p' | head -1)" "$shared/lib/"
  cat >"$shared/native.sh" <<'END'
export PYTHONPATH=/mnt/site LD_LIBRARY_PATH=/mnt/lib CONCORDEM_YADE_PLUGINS=/mnt/plugins
export NEW_LAW_NATIVE=1 NEW_LAW_PULL=/mnt/pull.toml NEW_LAW_OUT=/mnt/native.json
python3 -m concordem.yade build && yade -n -x -j1 /mnt/in_yade.py
END
  "$chroot" run "$shared" bash /mnt/native.sh >"$root/native.log" 2>&1 || { tail -n 60 "$root/native.log" >&2; exit 1; }
  [ -f "$shared/native.json" ] || { tail -n 60 "$root/native.log" >&2; exit 1; }
  mv "$shared/native.json" "$root/"
  "$python" "$here/hosts.py" "$tree" "$root" native
fi
echo "ran in $((SECONDS - started)) s"
