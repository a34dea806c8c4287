#!/usr/bin/env bash
# Builds the wheel and tests it as users install it: in a virtual environment, in Debian's Python, and in YADE.
#   yade-bridge/test.sh            all
#   yade-bridge/test.sh wheel      builds and installs the wheel
#   yade-bridge/test.sh python     tests the installed wheel, without YADE
set -euo pipefail
cd "$(dirname "$0")/.."
what=${1:-all}
bin=$PWD/.venv/bin
pythons=("$bin/python" "$PWD/.venv-debian/bin/python")
target=${CARGO_TARGET_DIR:-$PWD/target}

build_wheel() {
  # The library that users link the native plugin with; the wheel carries it.
  yade-bridge/native/build
  # No build isolation: the environment contains the build requirements, so no network is needed.
  PYO3_PYTHON=$bin/python "$bin/maturin" build --quiet --release --manifest-path yade-bridge/Cargo.toml --out "$target/wheels"
  local wheel
  wheel=$(ls -t "$target"/wheels/concordem-*.whl | head -1)
  for python in "${pythons[@]}"; do
    "$python" -m pip install --quiet --disable-pip-version-check --no-deps --force-reinstall "$wheel"
  done
}

test_python() {
  for python in "${pythons[@]}"; do
    "$python" -c 'import sys, numpy, concordem; print("Python", sys.version.split()[0], "NumPy", numpy.__version__, concordem.__file__)'
    # In another folder, to test the wheel and not the sources.
    (cd yade-bridge/tests && "$python" -m pytest -q -rs -p no:cacheprovider --rootdir . --ignore=yade --ignore=native .)
  done
  "$bin/python" -m mypy.stubtest concordem --mypy-config-file yade-bridge/pyproject.toml --allowlist yade-bridge/stubtest-allowlist.txt
}

case $what in
  wheel) build_wheel ;;
  python) test_python ;;
  all)
    build_wheel
    test_python
    yade-bridge/tests/yade/run.sh
    yade-bridge/tests/native/run.sh
    ;;
  *) echo "usage: test.sh [wheel | python]" >&2; exit 2 ;;
esac
