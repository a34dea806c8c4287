#!/bin/sh
# Regenerates law_tester.bin, jointed.bin, and joints.bin with the installed YADE and compares them with the committed files, byte for byte.
# With the argument `all`, also the specimens (minutes). Exit status 0: equal; 1: different; 2: YADE is missing or failed.
set -u
here=$(cd "$(dirname "$0")" && pwd)
part=${1:-law}
if ! command -v yade >/dev/null 2>&1; then
    echo "check_gold: no program 'yade' on PATH; install it (Debian: apt install yade) to run this check" >&2
    exit 2
fi
out=$(mktemp -d) || exit 2
trap 'rm -rf "$out"' EXIT
for script in make_gold make_jointed_gold make_joints_gold; do
    if ! GOLD_OUT="$out" GOLD_PART="$part" yade -n -x -j1 "$here/$script.py" >"$out/log" 2>&1; then
        echo "check_gold: yade failed in $script.py; its last lines:" >&2
        tail -n 20 "$out/log" >&2
        exit 2
    fi
done
status=0
files="law_tester.bin jointed.bin joints.bin"
[ "$part" = all ] && files="law_tester.bin jointed.bin joints.bin specimen.bin trajectory.bin"
for file in $files; do
    if cmp "$here/$file" "$out/$file"; then
        echo "check_gold: $file: $(wc -c <"$out/$file") bytes, equal"
    else
        echo "check_gold: $file made by the installed YADE differs from the committed one" >&2
        status=1
    fi
done
exit $status
