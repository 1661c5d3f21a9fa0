#!/bin/bash
# The tests, on two cores. Arguments are passed on to pytest (-m validate for the long ones, -n 0 for one process and its debugger).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
./setup.sh
unset PYTHONDONTWRITEBYTECODE  # bytecode is kept: the tests start many processes
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1 LC_ALL=C.UTF-8
exec .venv/bin/python -m pytest -n 2 --dist loadfile "$@"
