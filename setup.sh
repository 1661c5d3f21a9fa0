#!/bin/bash
# Makes everything ready on Debian 12 or 13: distribution packages, and a virtual environment in .venv. Safe to call again; then it takes no time.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8

PACKAGES=(python3-dolfinx python3-venv python3-matplotlib python3-h5py-mpi openmpi-bin gcc g++
          libglu1-mesa libxcursor1 libxinerama1 libxft2 libgl1 libegl1)
PYTHON=/usr/bin/python3   # a python3 found elsewhere on PATH would not have dolfinx
LOG=$(mktemp)
trap 'rm -f "$LOG"' EXIT

stop() {
  [ ! -s "$LOG" ] || tail -n 15 "$LOG" >&2
  echo "setup.sh: $1" >&2
  exit 1
}

installed() { dpkg-query -W -f='${Status}' "$1" 2>/dev/null | grep -q 'ok installed'; }

install_packages() {
  local missing=() admin=()
  for package in "${PACKAGES[@]}"; do installed "$package" || missing+=("$package"); done
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

make_environment() {
  local numpy
  echo "setup: making the virtual environment .venv"
  if ! { [ -x .venv/bin/python ] && .venv/bin/python -c '' 2>/dev/null && [ "$(.venv/bin/python -c 'import sys; print(sys.base_prefix)')" = /usr ]; }; then
    rm -rf .venv
    "$PYTHON" -m venv --system-site-packages .venv >"$LOG" 2>&1 || stop "the virtual environment .venv could not be made (above)"
  fi
  # dolfinx was built against the distribution's NumPy: keep that series
  numpy=$("$PYTHON" -c 'import numpy; print(".".join(numpy.__version__.split(".")[:2]))')
  echo "numpy==$numpy.*" >.venv/constraints.txt
  .venv/bin/python -m pip install -q --disable-pip-version-check --no-input -c .venv/constraints.txt -e '.[test]' </dev/null >"$LOG" 2>&1 ||
    stop "pip could not install the Python packages of pyproject.toml (above): is the package index reachable?"
  .venv/bin/python -c 'import dolfinx, mpi4py, numba, gmsh, pyvista, pydantic, pint, typer, pytest, xdist' >"$LOG" 2>&1 ||
    stop "an installed package does not import (above): remove .venv and call this again"
  : >"$LOG"
}

command -v dpkg-query >/dev/null && command -v apt-get >/dev/null || stop "this needs Debian 12 or 13: no apt-get found"
install_packages
# The stamp names what the environment was made from and where.
stamp=$({ pwd; "$PYTHON" --version; cat setup.sh pyproject.toml; } | sha256sum | cut -d' ' -f1)
if [ "$(cat .venv/.stamp 2>/dev/null)" != "$stamp" ] || [ ! -x .venv/bin/python ]; then
  make_environment
  echo "$stamp" >.venv/.stamp
  echo "setup: ready"
fi
