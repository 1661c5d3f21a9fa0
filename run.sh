#!/bin/bash
# The main job on 2 cores: a wheel passes the nose of a UK 1:10.75 cast crossing. Arguments are passed on (--restart, --overwrite).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
./setup.sh
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1
read -r -a mpirun <<<"$(.venv/bin/python -P -m rail_fem.processes.launcher 2)"
exec "${mpirun[@]}" .venv/bin/python -P -m mpi4py -m rail_fem run cases/nose_transfer.toml --out runs/nose_transfer "$@"
