#!/bin/bash
# The documents, with every script of the gallery executed: docs/_build/html/index.html. A warning is a fault.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
./setup.sh
.venv/bin/python -c 'import sphinx, myst_parser, furo, sphinx_gallery' 2>/dev/null ||
  .venv/bin/python -m pip install -q --disable-pip-version-check --no-input -c .venv/constraints.txt -e '.[docs]' </dev/null
exec .venv/bin/python -m sphinx -W --keep-going -q -b html docs docs/_build/html "$@"
