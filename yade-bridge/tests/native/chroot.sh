#!/usr/bin/env bash
# Debian 13 chroot (2.5 GB) with YADE 2025.2.0, g++, and the libraries of YADE's headers, for the tests of the native plugin.
#   chroot.sh make                   create it if it does not exist: debootstrap from apt's configured mirror
#   chroot.sh run FOLDER COMMAND     run COMMAND in it, with FOLDER mounted on /mnt (needs root)
#   chroot.sh once FOLDER COMMAND    the same in a copy, which is deleted after it
#   chroot.sh path                   print its folder: ${XDG_CACHE_HOME:-~/.cache}/concordem/debian-13
# BARE=SUITE: a bare Debian of that name (bookworm, trixie) instead, with python3-venv alone, for tests/install. WITH='PACKAGE...': with
# these packages, too, in a folder of its own.
# It is kept between runs; delete it with: rm -r --one-file-system "$(chroot.sh path)". Mounts are in a private mount namespace and
# end with the command.
set -euo pipefail

suite=trixie
root=${XDG_CACHE_HOME:-$HOME/.cache}/concordem/debian-13
# YADE, and what the book tells users to install for the build of the plugin: the compiler and the libraries that YADE's headers include.
page=$(dirname "$0")/../../../docs/book/reference/yade.md
packages=(yade $(sed -n '/^sudo apt install g++/,/[^\\]$/ { s/^sudo apt install//; s/#.*//; s/\\$//; p }' "$page"))
[ ${#packages[@]} -gt 5 ] || { echo "$page has no line with: sudo apt install g++" >&2; exit 1; }
if [ -n "${BARE:-}" ]; then
  suite=$BARE
  root=${root%/*}/bare-$BARE
  packages=(python3-venv)
  if [ -n "${WITH:-}" ]; then
    root=$root-${WITH%% *}
    packages+=($WITH)
  fi
fi

as_root() {
  [ "$(id -u)" = 0 ] || { echo "chroot.sh needs root: debootstrap and mounts" >&2; exit 1; }
}

# In a private mount namespace, so that nothing stays mounted, even after a failure.
inside() {
  local shared=$1
  shift
  unshare --mount --propagation unchanged --pid --fork --kill-child bash -c '
    set -euo pipefail
    root=$1 shared=$2
    shift 2
    # In a chroot, / is often not a mount point; then bind-mount the folder to itself, so that its mounts stay private.
    if ! mount --make-rprivate / 2>/dev/null; then
      mount --bind "$root" "$root"
      trap "umount --lazy \"$root\"" EXIT
      mount --make-rprivate "$root"
    fi
    mount -t proc proc "$root/proc"
    mount -t tmpfs -o mode=1777 tmpfs "$root/tmp"
    mount -t tmpfs -o mode=1777 tmpfs "$root/dev/shm"
    [ -z "$shared" ] || mount --bind "$shared" "$root/mnt"
    env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
      ${CI:+CI=$CI} ${CONCORDEM_TEST_FULL:+CONCORDEM_TEST_FULL=$CONCORDEM_TEST_FULL} chroot "$root" "$@"
  ' bash "$root" "$shared" "$@"
}

make_it() {
  [ -f "$root/complete" ] && return
  as_root
  # Lock, because `make test` starts this in the background and waits here later.
  mkdir -p "$(dirname "$root")"
  exec 9>"$root.lock"
  flock 9
  [ -f "$root/complete" ] && return
  command -v debootstrap >/dev/null || { echo "debootstrap is missing: .ci/setup test" >&2; exit 1; }
  local mirror
  mirror=$(apt-get indextargets --format '$(SITE)' 'Created-By: Packages' 'Origin: Debian' 'Label: Debian' | head -1)
  [ -n "$mirror" ] || { echo "apt is not configured with a Debian mirror (apt-get indextargets names none)" >&2; exit 1; }
  echo "making $root from $mirror (once)"
  rm -rf --one-file-system "$root"
  mkdir -p "$root"
  local log=$root.log
  {
    debootstrap --variant=minbase "$suite" "$root" "$mirror"
    printf 'deb %s %s main\ndeb-src %s %s main\n' "$mirror" "$suite" "$mirror" "$suite" >"$root/etc/apt/sources.list"
    printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d"
    chmod 755 "$root/usr/sbin/policy-rc.d"
    # No documentation, and no fsync: the folder can be recreated.
    printf 'force-unsafe-io\npath-exclude=/usr/share/doc/*\npath-exclude=/usr/share/man/*\npath-exclude=/usr/share/locale/*\n' \
      >"$root/etc/dpkg/dpkg.cfg.d/lean"
    cp /etc/resolv.conf "$root/etc/resolv.conf"
    inside '' apt-get update -qq
    inside '' apt-get install -y -qq --no-install-recommends "${packages[@]}"
    inside '' apt-get clean
  } >"$log" 2>&1 || { echo "making $root failed; the end of $log:" >&2; tail -n 30 "$log" >&2; exit 1; }
  touch "$root/complete"
}

case ${1:-} in
  make) make_it ;;
  path) echo "$root" ;;
  run)
    as_root
    [ -f "$root/complete" ] || { echo "$root is not there: chroot.sh make" >&2; exit 1; }
    shared=$2
    shift 2
    inside "$shared" "$@"
    ;;
  once)
    as_root
    [ -f "$root/complete" ] || { echo "$root is not there: chroot.sh make" >&2; exit 1; }
    shared=$2
    shift 2
    original=$root
    root=$(mktemp -d "$original.XXXXXX")
    trap 'rm -rf --one-file-system "$root"' EXIT
    cp -a --reflink=auto "$original/." "$root/"
    inside "$shared" "$@"
    ;;
  *) echo "usage: chroot.sh make | path | run FOLDER COMMAND... | once FOLDER COMMAND..." >&2; exit 2 ;;
esac
