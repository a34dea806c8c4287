#!/usr/bin/env bash
# Packages the crates as they would be published, and builds a crate of somebody else against the packages, not the tree.
#   run.sh           build each package alone, as a registry would, and the outside crate
#   run.sh quick     build the outside crate only
#   run.sh package   only make the packages
set -euo pipefail
cd "$(dirname "$0")/../.."
target=$PWD/${CARGO_TARGET_DIR:-target}/outside-crate
mapfile -t packages < <(cargo metadata --no-deps --format-version 1 |
  python3 -c 'import json, sys; print(*(p["name"] + "-" + p["version"] for p in json.load(sys.stdin)["packages"] if p["publish"] is None), sep="\n")')
crates=("${packages[@]%-*}")
verify=()
[ -z "${1:-}" ] || verify=(--no-verify)
cargo package --allow-dirty "${verify[@]}" --target-dir "$target" "${crates[@]/#/--package=}"
rm -rf "$target/unpacked" "$target/crate"
mkdir -p "$target/unpacked"
for package in "${packages[@]}"; do
  tar -xzf "$target/package/$package.crate" -C "$target/unpacked"
  for file in README.md LICENSE-MIT LICENSE-APACHE; do
    [ -s "$target/unpacked/$package/$file" ] || { echo "$file is missing in the package $package" >&2; exit 1; }
  done
done
[ "${1:-}" != package ] || exit 0
cp -r tests/outside_crate "$target/crate"
{
  echo "[patch.crates-io]"
  for folder in "$target"/unpacked/*; do
    name=$(basename "$folder")
    echo "${name%-*} = { path = \"$folder\" }"
  done
} >> "$target/crate/Cargo.toml"
cargo run --release --manifest-path "$target/crate/Cargo.toml" --target-dir "$target/build"
