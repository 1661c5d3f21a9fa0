#!/bin/bash
# The documents, with every script of the gallery executed: docs/_build/html/index.html. A warning is a fault.
# --only-environment stops once Sphinx is there; other arguments are Sphinx' own. Outside links: docs/links.sh.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
./setup.sh
.venv/bin/python -c 'import sphinx, myst_parser, furo, sphinx_gallery' 2>/dev/null ||
  .venv/bin/python -m pip install -q --disable-pip-version-check --no-input -c .venv/constraints.txt -c .venv/lock.txt -e '.[docs]' </dev/null
[ "${1:-}" != --only-environment ] || exit 0
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1 LC_ALL=C.UTF-8
exec .venv/bin/python -m sphinx -W --keep-going -q -b html docs docs/_build/html "$@"
