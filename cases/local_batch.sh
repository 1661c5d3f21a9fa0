#!/bin/bash
# cases/local_batch.sh [-n RANKS] CASE...: cases one after the other on this machine, each in runs/NAME.
# Called again, it goes on with what was cut off and passes over what is finished. A failed case does not stop the others.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
ranks=2
if [ "${1:-}" = -n ]; then ranks=$2; shift 2; fi
[ $# -gt 0 ] || { sed -n 2,3p "${BASH_SOURCE[0]}"; exit 2; }
./setup.sh || exit 1
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1
read -r -a mpirun <<<"$(.venv/bin/python -P -m rail_fem.launcher "$ranks")"
failed=0
for case in "$@"; do
  folder=${RUNS:-runs}/$(basename "$case" .toml)
  if grep -qs '"state": "finished"' "$folder/status.json"; then echo "$case: finished before, see $folder"; continue; fi
  mkdir -p "$(dirname "$folder")"
  echo "$case: running, see $folder"
  "${mpirun[@]}" .venv/bin/python -P -m mpi4py -m rail_fem run "$case" --out "$folder" --restart </dev/null || { echo "$case: FAILED"; failed=$((failed + 1)); }
done
echo "$(($# - failed)) case(s) well, $failed failed"
[ "$failed" -eq 0 ]
