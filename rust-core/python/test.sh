#!/usr/bin/env bash
# Builds the Python package and tests it: in a virtual environment, in Debian's own Python, and in YADE.
#   rust-core/python/test.sh            all
#   rust-core/python/test.sh package    builds the package against Debian's HDF5 and installs it without a wheel, which would compile
#                                       everything again with HDF5 inside; BUILT=1: the libraries are already there (make test-build)
#   rust-core/python/test.sh python     tests the installed package, without YADE
# The installed package also lies in target/python, for the native plugin's tests in Debian 13.
set -euo pipefail
cd "$(dirname "$0")/../.."
what=${1:-all}
bin=$PWD/.venv/bin
pythons=("$bin/python" "$PWD/.venv-debian/bin/python")
target=${CARGO_TARGET_DIR:-$PWD/target}

install_package() {
  # The selection of `make test`, so that nothing is compiled twice.
  [ -n "${BUILT:-}" ] || ${CARGO:-cargo} build --release --workspace --exclude concordem-bench --lib --bins
  BUILT=1 yade-bridge/native/build
  rm -rf "$target/python"
  mkdir -p "$target/python"
  # With concordem.yade, which is a link here.
  cp -rL rust-core/python/python/concordem "$target/python/"
  find "$target/python" -name __pycache__ -prune -exec rm -r {} +
  cp "$target/release/lib_core.so" "$target/python/concordem/_core.abi3.so"
  for python in "${pythons[@]}"; do
    local site
    site=$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
    rm -rf "$site/concordem"
    cp -r "$target/python/concordem" "$site/"
    # As pip does: YADE writes no compiled modules itself, and each import would compile them.
    "$python" -m compileall -q "$site/concordem"
  done
}

test_python() {
  # Waiting threads of NumPy's linear algebra must not spin while other tests need the processors.
  export OPENBLAS_NUM_THREADS=1
  # One module serves every interpreter. The others test what meets their NumPy, and the packages of YADE, but not what is marked `once`.
  local tests=()
  for python in "${pythons[@]}"; do
    "$python" -c 'import sys, numpy, concordem; print("Python", sys.version.split()[0], "NumPy", numpy.__version__, concordem.__file__)'
    # From another folder, so that the installed package is tested and not the sources.
    (cd rust-core/python/tests && "$python" -m pytest -q -rs -p no:cacheprovider --rootdir . "${tests[@]}" .)
    (cd yade-bridge/tests && "$python" -m pytest -q -rs -p no:cacheprovider --rootdir . test_*.py)
    tests=(-m "not once")
  done
  "$bin/python" -m mypy.stubtest concordem --mypy-config-file rust-core/python/pyproject.toml --allowlist rust-core/python/stubtest-allowlist.txt --ignore-unused-allowlist
}

case $what in
  package) install_package ;;
  python) test_python ;;
  all)
    install_package
    test_python
    yade-bridge/tests/yade/run.sh
    yade-bridge/tests/native/run.sh
    ;;
  *) echo "usage: test.sh [package | python]" >&2; exit 2 ;;
esac
