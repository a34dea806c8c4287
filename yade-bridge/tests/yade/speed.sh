#!/usr/bin/env bash
# Speeds of the bridge beside YADE's own, one thread and two. One JSON object each; nothing else should run meanwhile.
set -euo pipefail
cd "$(dirname "$0")"
site=$(../../../.venv-debian/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
for threads in 1 2; do
  PYTHONPATH=$site yade -n -x "-j$threads" speed.py 2>&1 | sed -n 's/^RESULT //p' | grep . || { echo "speed.py -j$threads gave no result" >&2; exit 1; }
done
