#!/usr/bin/env bash
# Installs the wheel of `make wheel` where users do, and works with it: the program, the package, and h5py beside it.
#   tests/install/run.sh                 everywhere
#   tests/install/run.sh PLACE...        venv: a fresh virtual environment; sdist: another one, from the source package;
#                                        bookworm, trixie: bare Debian 12 and 13; deb: the Debian package in a bare Debian 12
# bookworm, trixie, and deb need root. What pip installs beside the wheel is fetched here, so the bare systems need no network.
set -euo pipefail
cd "$(dirname "$0")/../.."
here=tests/install
root=$PWD/target/install
mkdir -p "$root"
wheel=$(ls target/wheels/concordem-*.whl 2>/dev/null | head -1)
[ -n "$wheel" ] || { echo "there is no wheel in target/wheels: make wheel" >&2; exit 1; }
echo "$wheel: $(($(stat -c %s "$wheel") / 1000)) kB"

# fetch FOLDER VERSION-OF-PYTHON: NumPy and h5py as wheels.
fetch() {
  .venv-wheel/bin/pip download --quiet --disable-pip-version-check --only-binary :all: --python-version "$2" \
    --platform manylinux_2_28_x86_64 --platform manylinux_2_17_x86_64 --platform manylinux2014_x86_64 --dest "$1" numpy h5py
}

# A folder for a bare system: the wheel, what it needs, and the checks.
prepare() {
  local folder=$1 python=$2
  rm -rf "$folder"
  mkdir -p "$folder/packages"
  fetch "$folder/packages" "$python"
  cp "$wheel" "$folder/packages/"
  cp "$here"/*.sh "$here"/*.py "$folder/"
}

in_debian() {
  local suite=$1 python=$2
  BARE=$suite yade-bridge/tests/native/chroot.sh make
  prepare "$root/$suite" "$python"
  BARE=$suite yade-bridge/tests/native/chroot.sh run "$root/$suite" bash /mnt/check.sh /mnt python3 /tmp/check
}

for place in "${@:-all}"; do
  case $place in
    all) "$0" venv bookworm trixie deb sdist ;;
    venv)
      version=$(python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
      prepare "$root/venv" "$version"
      rm -rf "$root/check"
      "$here/check.sh" "$root/venv" python3 "$root/check"
      ;;
    bookworm) in_debian bookworm 3.11 ;;
    trixie) in_debian trixie 3.13 ;;
    deb)
      # apt needs its mirror for the dependencies of the package; the program itself needs none but the C library.
      rm -rf "$root/deb"
      mkdir -p "$root/deb"
      cp target/debian/concordem_*.deb "$here"/program.sh "$root/deb/"
      BARE=bookworm yade-bridge/tests/native/chroot.sh make
      BARE=bookworm yade-bridge/tests/native/chroot.sh run "$root/deb" bash -c \
        'dpkg --install /mnt/concordem_*.deb && bash /mnt/program.sh concordem /tmp/check; code=$?; dpkg --remove concordem; exit $code'
      ;;
    sdist)
      # Compiles everything again, with HDF5, as `pip install` of the source package does.
      rm -rf "$root/sdist" "$root/from-sdist"
      python3 -m venv "$root/sdist"
      "$root/sdist/bin/pip" install --quiet --disable-pip-version-check cmake
      PATH=$root/sdist/bin:$PATH "$root/sdist/bin/pip" install --quiet --disable-pip-version-check target/wheels/concordem-*.tar.gz
      "$here/program.sh" "$root/sdist/bin/concordem" "$root/from-sdist"
      ;;
    *) echo "run.sh: unknown place $place" >&2; exit 2 ;;
  esac
  [ "$place" = all ] || echo "$place: passed"
done
