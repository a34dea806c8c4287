#!/usr/bin/env bash
# What run.sh runs in Debian 13; /mnt/site is the wheel, /mnt/repo the tests.
set -euo pipefail
export PYTHONPATH=/mnt/site LD_LIBRARY_PATH=/mnt/lib CONCORDEM_YADE_PLUGINS=/mnt/plugins PYTHONUNBUFFERED=1 YADE_EXAMPLES=/mnt/examples
cd /mnt/repo/yade-bridge/tests/native
what=${1:-tests}
# Of tests that run side by side, threads that wait must not take the processor from those that work. Speeds are those of users.
[ "$what" = speed ] || export OMP_WAIT_POLICY=passive
[ "$what" = speed ] || python3 test_build.py
started=$SECONDS
python3 -m concordem.yade build
echo "building the plugin took $((SECONDS - started)) s"
failed=0
if [ "$what" = speed ]; then
  for threads in 1 2; do
    yade -n -x "-j$threads" speed.py 2>/dev/null | sed -n 's/^RESULT //p' | grep . || { echo "speed.py -j$threads gave no result" >&2; exit 1; }
  done
  exit
fi

# The gold data of YADE 2023.02a, made again by this YADE with its own law and with ours: the same bytes.
for law in Law2_ScGeom_CpmPhys_Cpm Law2_ScGeom_CpmPhys_Rust; do
  mkdir -p "/tmp/$law"
  if GOLD_OUT=/tmp/$law GOLD_PART=law GOLD_LAW=$law yade -n -x -j1 /mnt/repo/tests/golden/yade/make_gold.py >/tmp/log 2>&1 \
    && cmp /mnt/repo/tests/golden/yade/law_tester.bin "/tmp/$law/law_tester.bin"; then
    echo "$law: $(grep -c 'steps, ended' /tmp/log) LawTester paths equal to the gold data, $(stat -c %s "/tmp/$law/law_tester.bin") bytes"
  else
    echo "$law FAILED on the gold data:" >&2
    tail -n 20 /tmp/log >&2
    failed=1
  fi
done

# SCRIPT THREADS: run it, and keep its words.
run() {
  # Without a terminal YADE ends with 0 although a script failed early; the last line of each says that it came through.
  mkdir -p "/tmp/$1-$2"
  BRIDGE_WORK=/tmp/$1-$2 yade -n -x "-j$2" "$1" >"/tmp/$1-$2.log" 2>&1 && grep -q '^ALL TESTS PASSED' "/tmp/$1-$2.log"
}
tell() {
  if [ "$3" = 0 ]; then
    echo "$1 -j$2: $(grep -c '^ok ' "/tmp/$1-$2.log") tests passed"
    grep '^COST' "/tmp/$1-$2.log" || true
  else
    echo "$1 -j$2 FAILED:" >&2
    grep -v '^ok ' "/tmp/$1-$2.log" | tail -n 60 >&2
    failed=1
  fi
}
# The functor needs one thread (YADE's own sums are not reproducible with more), so the engine's tests run beside it.
run test_functor.py 1 &
functor=$!
for threads in 1 2; do
  for script in test_bonds.py test_beams.py test_deformable.py test_laws.py; do
    status=0
    run "$script" "$threads" || status=$?
    tell "$script" "$threads" "$status"
  done
  grep -h '^BITS' "/tmp/test_bonds.py-$threads.log" "/tmp/test_deformable.py-$threads.log" >>/tmp/bits || true
done
status=0
wait "$functor" || status=$?
tell test_functor.py 1 "$status"
if [ "$(wc -l </tmp/bits)" != 10 ] || [ "$(sort -u /tmp/bits | wc -l)" != 5 ]; then
  echo "bits of the bonded engine, or of deformable particles, differ between -j1 and -j2:" >&2
  cat /tmp/bits >&2
  failed=1
fi
# YADE's shipped examples with one line of ours.
python3 examples.py native || failed=1
exit $failed
