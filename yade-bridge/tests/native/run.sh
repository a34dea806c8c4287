#!/usr/bin/env bash
# Builds the native plugin from the wheel in the Debian 13 chroot, as a user would, and tests it. Needs root, the wheel (test.sh builds it),
# and, the first time, the network; see chroot.sh.
#   run.sh           run the tests
#   run.sh speed     compare speeds with YADE; prints one line of JSON per number of threads
#   run.sh FILE.py   run one file of tests on one thread
set -euo pipefail
cd "$(dirname "$0")/../../.."
here=yade-bridge/tests/native
target=${CARGO_TARGET_DIR:-target}
if [ "$(id -u)" != 0 ] && [ -z "${CI:-}" ]; then
  echo "the native plugin of YADE was NOT tested: its Debian 13 needs root (debootstrap, mounts); run $here/run.sh as root" >&2
  exit 0
fi
"$here/chroot.sh" make
work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT
mkdir -p "$work/repo/yade-bridge/tests" "$work/repo/tests/golden" "$work/lib"
cp -r "$target/python" "$work/site"
cp -r "$here" "$work/repo/yade-bridge/tests/native"
cp yade-bridge/tests/yade/{harness,specimen,cohesive_scene,jointed_scene,random_histories,random_scripts,own_run,examples,example_driver,run_examples,public_scripts,functions}.py "$work/repo/yade-bridge/tests/native/"
cp yade-bridge/tests/yade/{test_*.py,functions.json} "$work/repo/yade-bridge/tests/native/"
# The chroot has no documentation, which contains YADE's examples.
cp -r "${YADE_EXAMPLES:-/usr/share/doc/yade/examples/concrete}" "$work/examples"
cp -r yade-bridge/examples "$work/own-examples"
cp -r tests/golden/yade "$work/repo/tests/golden/yade"
# The wheel is built on Debian 12 and needs its HDF5 (package libhdf5-103-1); Debian 13 has another version.
cp -L "$(ldconfig -p | sed -n 's/.*libhdf5_serial\.so\.103 .*=> //p' | head -1)" "$work/lib/"
"$here/chroot.sh" run "$work" bash /mnt/repo/yade-bridge/tests/native/inside.sh "${1:-tests}"
