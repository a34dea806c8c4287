#!/usr/bin/env bash
# program.sh PROGRAM WORK: an installed program does what the README says, in the new folder WORK: a run, Ctrl-C, exit codes.
set -euo pipefail
program=$1 work=$2
rm -rf "$work"
mkdir -p "$work"
cd "$work"
export CONCORDEM_CACHE=$work/cache
fail() { echo "program.sh: $*" >&2; exit 1; }

"$program" --version
"$program" init --template cpm-small first.toml
"$program" check first.toml >check.txt
grep -q particles check.txt || fail "check prints no particles"
"$program" run first.toml
"$program" info first.h5 | grep -q 'state hash' || fail "info prints no hash"
"$program" report first.h5
[ -s first.html ] || fail "there is no report"

# Exit codes: wrong arguments 2, a missing file 3.
code=0; "$program" run --no-such-option 2>message.txt || code=$?
[ $code = 2 ] || fail "exit code $code for a wrong option"
code=0; "$program" info missing.h5 2>message.txt || code=$?
[ $code = 3 ] || fail "exit code $code for a missing file"
# A name that is no text.
name=$(printf 'a\377.toml')
"$program" init --template cpm-small "$name" && [ -f "$name" ] || fail "a file name that is no UTF-8"

# Ctrl-C: a checkpoint, exit code 130, no traceback; the resumed run equals the uninterrupted one. bash lets background processes ignore
# Ctrl-C unless it has job control.
set -m
"$program" run first.toml -o second.h5 2>second.txt &
process=$!
until ls second.h5.parts/checkpoint-0000.h5 2>/dev/null >&2; do
  kill -0 $process 2>/dev/null || fail "the run ended before Ctrl-C: $(cat second.txt)"
  sleep 0.02
done
sleep 0.3
kill -INT $process
code=0; wait $process || code=$?
set +m
[ $code = 130 ] || fail "exit code $code after Ctrl-C: $(cat second.txt)"
grep -q 'interrupted at step' second.txt || fail "no message after Ctrl-C: $(cat second.txt)"
! grep -qi traceback second.txt || fail "a traceback: $(cat second.txt)"
"$program" resume -q second.h5
[ "$("$program" info --hash first.h5)" = "$("$program" info --hash second.h5)" ] || fail "the resumed run differs"
echo "the program works: $(cat check.txt | sed -n 's/^ *particles  *//p' | head -1) particles, hash $("$program" info --hash first.h5 | head -c 12)"
