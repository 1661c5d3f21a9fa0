#!/bin/bash
# Makes everything ready on Debian 12 or 13: distribution packages, and a virtual environment in .venv. Safe to call again:
# then it only looks whether all is still there and NumPy the distribution's, and repairs what is not. Python packages are
# those of constraints/, with which the tests passed; `./setup.sh --renew` makes .venv of the newest that pyproject.toml
# allows, and writes them there.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8

PACKAGES=(python3-dolfinx python3-venv python3-matplotlib python3-h5py python3-h5py-mpi openmpi-bin gcc g++
          libglu1-mesa libxcursor1 libxinerama1 libxft2 libgl1 libegl1)
PYTHON=/usr/bin/python3   # a python3 found elsewhere on PATH would not have dolfinx
LOG=$(mktemp)
trap 'rm -f "$LOG"' EXIT

stop() {
  [ ! -s "$LOG" ] || tail -n 15 "$LOG" >&2
  echo "setup.sh: $1" >&2
  exit 1
}

install_packages() {
  local missing=() admin=() here
  here=$(dpkg-query -W -f='${Status} ${Package} \n' "${PACKAGES[@]}" 2>/dev/null | sed -n 's/.*ok installed//p') || true  # fails where one of them is not known
  for package in "${PACKAGES[@]}"; do case "$here" in *" $package "*) ;; *) missing+=("$package") ;; esac; done
  [ ${#missing[@]} -gt 0 ] || return 0
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || stop "the packages ${missing[*]} are missing and there is no sudo: as root run 'apt-get install ${missing[*]}', then call this again"
    admin=(sudo); [ -t 0 ] || admin=(sudo -n)
    "${admin[@]}" true 2>>"$LOG" || stop "the packages ${missing[*]} are missing and sudo is not allowed: ask an administrator for 'apt-get install ${missing[*]}', then call this again"
  fi
  echo "setup: installing ${missing[*]}"
  "${admin[@]}" apt-get update -q </dev/null >"$LOG" 2>&1 || stop "apt-get update failed (above): is the package mirror reachable?"
  "${admin[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" </dev/null >"$LOG" 2>&1 ||
    stop "apt-get could not install ${missing[*]} (above): free disk space, or a Debian other than 12 and 13?"
  : >"$LOG"
}

# What is missing or not the distribution's, a line each, by a look at the files; a broken interpreter is a fault too.
faults() { .venv/bin/python -m rail_fem.run.installation 2>/dev/null || [ $? -eq 1 ] || echo "the interpreter does not start"; }

in_environment() { .venv/bin/python -m pip "$@" --disable-pip-version-check --no-input </dev/null >>"$LOG" 2>&1; }

make_environment() {
  local numpy broken extras=fe,plot3d,page,test,lint
  [ -z "$renew" ] || { rm -rf .venv; extras+=,docs; }
  if ! { [ -x .venv/bin/python ] && .venv/bin/python -c '' 2>/dev/null && [ "$(.venv/bin/python -c 'import sys; print(sys.base_prefix)')" = /usr ]; }; then
    rm -rf .venv
    "$PYTHON" -m venv --system-site-packages .venv >"$LOG" 2>&1 || stop "the virtual environment .venv could not be made (above)"
  fi
  # dolfinx was built against the distribution's NumPy: keep that series, also when somebody calls .venv/bin/pip later
  numpy=$("$PYTHON" -c 'import numpy; print(".".join(numpy.__version__.split(".")[:2]))')
  echo "numpy==$numpy.*" >.venv/constraints.txt
  "$PYTHON" -c 'import pathlib; print("[install]\nconstraint =", pathlib.Path(".venv/constraints.txt").resolve().as_uri())' >.venv/pip.conf
  cp "$LOCK" .venv/lock.txt 2>/dev/null || : >.venv/lock.txt  # another Python's: pyproject.toml's bounds alone; docs/build.sh reads it too
  [ -z "$renew" ] || : >.venv/lock.txt
  case "$(faults)" in *"NumPy "*"has taken the place"*) in_environment uninstall -q -y numpy || stop "pip could not take the foreign NumPy out of .venv (above)" ;; esac
  in_environment install -q -c .venv/lock.txt -e ".[$extras]" ||
    stop "pip could not install the Python packages of pyproject.toml as $LOCK names them (above): is the package index reachable? If it no longer has one of them: ./setup.sh --renew"
  broken=$(.venv/bin/python -m rail_fem.run.installation --broken)  # emptied folders, which pip takes for installed
  # shellcheck disable=SC2086
  [ -z "$broken" ] || in_environment install -q --force-reinstall --no-deps $broken || stop "pip could not install $broken again (above): remove .venv and call this again"
  .venv/bin/python -c 'import dolfinx, mpi4py, numba, gmsh, pyvista, pydantic, pint, typer, pytest, xdist' >"$LOG" 2>&1 ||
    stop "an installed package does not import (above): remove .venv and call this again"
  [ -z "$renew" ] || .venv/bin/python -m pip freeze --local --exclude-editable >"$LOCK"
  : >"$LOG"
}

renew=; [ "${1:-}" != --renew ] || renew=yes
command -v dpkg-query >/dev/null && command -v apt-get >/dev/null || stop "this needs Debian 12 or 13: no apt-get found"
install_packages
LOCK=constraints/python$("$PYTHON" -c 'import sys; print("%d.%d" % sys.version_info[:2])').txt
# What the environment was made from and where.
stamp() { { pwd; "$PYTHON" --version; cat setup.sh pyproject.toml; cat "$LOCK" 2>/dev/null || true; } | sha256sum | cut -d' ' -f1; }
if [ -n "$renew" ]; then
  echo "setup: making the virtual environment .venv of the newest packages, and writing them to $LOCK"
elif [ "$(cat .venv/.stamp 2>/dev/null)" != "$(stamp)" ] || [ ! -x .venv/bin/python ]; then
  echo "setup: making the virtual environment .venv"
elif fault=$(faults) && [ -n "$fault" ]; then
  echo "setup: repairing the virtual environment .venv: $(paste -sd ';' <<<"$fault")"
else
  exit 0
fi
make_environment
stamp >.venv/.stamp
echo "setup: ready"
