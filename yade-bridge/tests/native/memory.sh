#!/usr/bin/env bash
# Runs the native plugin under valgrind in the Debian 13 chroot: every class is created, run, saved, loaded, reset. Passes if no error has
# a frame of our code and our code leaks no memory. Not part of `make test`; takes some minutes. Needs root, the wheel, and one earlier
# call of run.sh (see chroot.sh). The first call installs valgrind in the chroot.
#   memory.sh [LOG]     path of valgrind's log; default: target/yade-valgrind.log
set -euo pipefail
cd "$(dirname "$0")/../../.."
here=yade-bridge/tests/native
target=${CARGO_TARGET_DIR:-target}
log=${1:-$target/yade-valgrind.log}
root=$("$here/chroot.sh" path)
if [ ! -x "$root/usr/bin/valgrind" ]; then
  "$here/chroot.sh" run "" bash -c 'apt-get update -qq && apt-get install -y -qq --no-install-recommends valgrind'
fi
work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT
mkdir -p "$work/lib" "$work/plugins"
cp -r "$target/python" "$work/site"
cp "$here/memory.py" "$work/"
cp -L "$(ldconfig -p | sed -n 's/.*libhdf5_serial\.so\.103 .*=> //p' | head -1)" "$work/lib/"
status=0
"$here/chroot.sh" run "$work" bash -c '
  set -euo pipefail
  export PYTHONPATH=/mnt/site LD_LIBRARY_PATH=/mnt/lib CONCORDEM_YADE_PLUGINS=/mnt/plugins OMP_NUM_THREADS=1
  python3 -m concordem.yade build
  # Without the allocator of Python, which hides its blocks from valgrind.
  PYTHONMALLOC=malloc valgrind --leak-check=full --show-leak-kinds=definite --num-callers=40 --log-file=/mnt/valgrind.log \
    python3 /usr/bin/yade -n -x -j1 /mnt/memory.py
' || status=$?
cp "$work/valgrind.log" "$log"
[ "$status" = 0 ] || { echo "the run itself failed" >&2; exit 1; }
python3 - "$log" <<'EOF'
import re
import sys

# A block is an error or a leak with its stack; ours have a frame in the plugin.
blocks, block = [], []
with open(sys.argv[1], errors="replace") as file:
    for line in file:
        text = re.sub(r"^==\d+== ?", "", line.rstrip("\n"))
        if text.strip():
            block.append(text)
        elif block:
            blocks.append(block)
            block = []
blocks.append(block)
stacks = [b for b in blocks if any(re.match(r"\s+(at|by) 0x", text) for text in b)]
errors, losses = [], []
for b in stacks:
    if not any("/mnt/plugins/" in text or "concordem" in text for text in b):
        continue
    if "lost" not in b[0]:
        errors.append(b)
        continue
    # The first frame after the allocator owns the memory. YADE leaks the sums of its EnergyTracker and, on exit, all objects that Python
    # holds, including those of our classes.
    taker = next(text for text in b[1:] if not re.search(r"vg_replace_malloc|operator new", text))
    if not re.search(r"EnergyTracker|OpenMPArrayAccumulator|Serializable_ctor_kwAttrs", taker):
        losses.append(b)
ours = errors + losses
ended = any("ERROR SUMMARY" in text for b in blocks for text in b)
for b in ours[:20]:
    print("\n".join(b), end="\n\n")
print(f"valgrind: {len(stacks)} reports in all, ours: {len(errors)} errors, {len(losses)} losses; log: {sys.argv[1]}")
sys.exit(0 if ended and not ours else 1)
EOF
