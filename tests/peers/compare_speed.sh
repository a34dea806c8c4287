#!/usr/bin/env bash
# Compares our speed with that of Debian's YADE: the same packing, bonds, and steps, one program after the other,
# each with one thread, then with two. Prints one JSON object per run and the ratios.
#   tests/peers/compare_speed.sh [packing.txt] [steps]
set -euo pipefail
cd "$(dirname "$0")/../.."
command -v yade >/dev/null || { echo "YADE is not installed: apt-get install yade" >&2; exit 2; }
cargo build --release --quiet -p concordem --example speed --bin concordem
packing=${1:-}
steps=${2:-500}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ -z "$packing" ]; then
  packing=$work/packing.txt
  cp validation/scenarios/specimen-tension.toml "$work/specimen.toml"
  target/release/concordem pack --quiet --force --output "$packing" "$work/specimen.toml"
fi
for threads in 1 2; do
  YADE_PACKING=$packing YADE_RATIO=1.5 YADE_STEPS=$steps yade -n -x "-j$threads" tests/peers/yade_cpm_speed.py 2>/dev/null \
    | sed -n 's/^RESULT //p' > "$work/yade.$threads"
  RAYON_NUM_THREADS=$threads target/release/examples/speed "$packing" 1.5 "$steps" > "$work/concordem.$threads"
  cat "$work/yade.$threads" "$work/concordem.$threads"
  python3 - "$threads" "$work/yade.$threads" "$work/concordem.$threads" <<'P'
import json, sys
threads, yade, ours = sys.argv[1], json.load(open(sys.argv[2])), json.load(open(sys.argv[3]))
for which in "best", "median":
    theirs, mine = yade["ns_per_bond_and_step"][which], ours["ns_per_bond_step_" + which]
    print(f"{threads} thread(s), {which}: YADE {theirs:.1f}, ConcorDEM {mine:.1f} ns per bond and step; ratio {theirs / mine:.2f}")
P
done
