#!/usr/bin/env bash
# Other readers can open our results: reads the file of a small run and its exports, particles and bonds, with VTK (geometry, fields, time
# steps) and h5py.
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
target/release/concordem init --template cpm-small "$work/small.toml"
target/release/concordem run --quiet "$work/small.toml"
.venv/bin/python tests/vtk_readback.py "$work/small.h5"
target/release/concordem export "$work/small.h5"
.venv/bin/python tests/vtk_readback.py "$work/small.particles.vtkhdf"
.venv/bin/python tests/vtk_readback.py "$work/small.bonds.vtkhdf"
target/release/concordem report "$work/small.h5"
test -s "$work/small.html"
