#!/usr/bin/env bash
# The report of a run and of several runs, the structure of a packing, and a running specimen in a browser: accessibility (axe), sizes, load times, screenshots in
# target/pages. Needs Node.js, npm, and Chromium (CHROMIUM, /usr/bin/chromium by default); fetches axe-core and puppeteer-core.
set -euo pipefail
cd "$(dirname "$0")/../.."
program=$PWD/target/release/concordem
out=$PWD/target/pages
mkdir -p "$out"
for tool in node npm "${CHROMIUM:-/usr/bin/chromium}"; do
  command -v "$tool" >/dev/null || { echo "$tool is missing: .ci/setup pages installs it" >&2; exit 1; }
done
if [ ! -d "$out/node_modules/puppeteer-core" ]; then
  npm install --silent --no-audit --no-fund --prefix "$out" axe-core@4 puppeteer-core@24 >/dev/null
fi
cd "$out"
"$program" init --force --template cpm-small small.toml
"$program" run -q --force small.toml
"$program" run -q --force small.toml -o other.h5 --set packing.seed=7
"$program" report --force small.h5 -o small.html
"$program" report --force small.h5 other.h5 -o several.html
"$program" characterise --force small.toml -o packing.html
# A specimen that runs until it has been looked at.
"$program" run -q --force small.toml -o live.h5 --watch --set 'stop={steps=10_000_000}' 2>live.txt &
live=$!
trap 'kill $live' EXIT
until address=$(grep -o 'http://[0-9.:]*/' live.txt); do
  kill -0 $live
  sleep 0.1
done
node "$OLDPWD/tests/pages/check.mjs" "$out" "$out/screenshots" small.html several.html packing.html "$address"
