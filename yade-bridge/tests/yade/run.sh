#!/usr/bin/env bash
# Runs the tests of the bridge in stock YADE, headless, with the wheel that test.sh has installed for Debian's Python.
#   run.sh          the tests
#   run.sh many …   hundreds of random scripts (many_scripts.py)
set -euo pipefail
cd "$(dirname "$0")"
command -v yade >/dev/null || { echo "yade is not installed: apt-get install yade" >&2; exit 2; }
site=$(../../../.venv-debian/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
export PYTHONPATH=$site
# Waiting threads must not spin while other tests need the processors.
export OMP_WAIT_POLICY=passive
[ "${1:-}" != many ] || exec python3 many_scripts.py "${@:2}"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0
for script in test_*.py; do
  for threads in 1 2; do
    # With two threads, only the tests that are marked so run (harness.py). A script that needs one thread (YADE's own sums are not
    # reproducible with more) says so in its second line.
    grep -q '^# threads: 1$' "$script" && [ "$threads" != 1 ] && continue
    started=$SECONDS
    # Without a terminal YADE ends with 0 although a script failed early; the last line of each says that it came through.
    if BRIDGE_WORK=$work timeout 900 yade -n -x "-j$threads" "$script" >"$work/log" 2>&1 && grep -q '^ALL TESTS PASSED' "$work/log"; then
      echo "$script -j$threads: $(grep -c '^ok ' "$work/log") tests passed in $((SECONDS - started)) s"
    else
      echo "$script -j$threads FAILED:" >&2
      grep -v '^ok ' "$work/log" | tail -n 40 >&2
      failed=1
    fi
  done
done
# YADE's shipped examples with one line of ours.
python3 examples.py header-free || failed=1
# Our own examples.
python3 run_examples.py || failed=1
exit $failed
