#!/usr/bin/env bash
# "One kind is one file and one line": a new operator, or a new kind of wall, in a copy of the sources, in scenario, result, report,
# book, and Python.
#   run.sh operator|wall   needs what `make test-python` needs; keeps the copy and what it built in target/new-KIND
set -euo pipefail
cd "$(dirname "$0")/../.."
kind=$1
case $kind in
operator) list=rust-core/scenario/src/sampling/operators ;;
wall) list=rust-core/scenario/src/walls ;;
esac
here=$PWD/tests/new_kind
new=$(echo "$here/$kind"/*.rs)
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
unset CARGO_TARGET_DIR
root=$target/new-$kind
tree=$root/tree
python=$PWD/.venv/bin/python
"$python" "$here/put_in.py" "$PWD" "$tree" "$new" "$list"
# Dependencies that are compiled already.
if [ ! -d "$tree/target" ] && [ -d "$target/release" ]; then
  mkdir "$tree/target"
  cp -a "$target/release" "$tree/target/"
fi
cd "$tree"
cargo=${CARGO:-cargo}
started=$SECONDS
rustfmt --edition 2024 --check "$list/$(basename "$new")"
# The package, whose program is the program; the selection of `make test`, so that dependencies are not compiled again.
$cargo build --release --workspace --exclude concordem-bench --lib
rm -rf "$root/site"
mkdir "$root/site"
# Links become files.
cp -rL rust-core/python/python/concordem "$root/site/"
cp target/release/lib_core.so "$root/site/concordem/_core.abi3.so"
printf '#!/bin/sh\nPYTHONPATH=%q exec %q -m concordem "$@"\n' "$root/site" "$python" >"$root/concordem"
chmod +x "$root/concordem"
echo "built in $((SECONDS - started)) s"
CONCORDEM=$root/concordem PYTHONPATH=$root/site "$python" "$here/$kind/check.py" "$tree" "$root"
