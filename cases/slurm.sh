#!/bin/bash
# sbatch cases/slurm.sh [CASE [DIR]]: one case on a cluster. A requeued or resubmitted job goes on from its last restart file.
#SBATCH --job-name=rail-fem
#SBATCH --ntasks=16
#SBATCH --cpus-per-task=1
#SBATCH --mem-per-cpu=2G
#SBATCH --time=12:00:00
#SBATCH --requeue
#SBATCH --output=%x-%j.log
set -euo pipefail
cd "${SLURM_SUBMIT_DIR:-$(dirname "${BASH_SOURCE[0]}")/..}"
case=${1:-cases/whole_crossing.toml}
folder=${2:-runs/$(basename "$case" .toml)}
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1
# "-P": nothing is imported from the current folder. "-m mpi4py" ends the whole job when one rank fails; without it the others would wait for the time limit.
exec mpirun -n "${SLURM_NTASKS:-2}" .venv/bin/python -P -m mpi4py -m rail_fem run "$case" --out "$folder" --restart
