#!/bin/bash
# sbatch cases/slurm_array.sh: the 16 cases of the thesis, one for each task of the array. Resubmitted, it goes on with what is not finished.
#SBATCH --job-name=rail-fem-sweep
#SBATCH --array=1-16
#SBATCH --ntasks=4
#SBATCH --cpus-per-task=1
#SBATCH --mem-per-cpu=2G
#SBATCH --time=04:00:00
#SBATCH --output=%x-%A-%a.log
set -euo pipefail
cd "${SLURM_SUBMIT_DIR:-$(dirname "${BASH_SOURCE[0]}")/..}"
exec .venv/bin/python -P -m rail_fem sweep cases/thesis/*.toml --out runs/thesis --only "${SLURM_ARRAY_TASK_ID:-1}" --ranks "${SLURM_NTASKS:-2}"
