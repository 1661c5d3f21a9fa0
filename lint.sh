#!/bin/bash
# Lint, format and types, of the examples too, as continuous integration checks them; needs the environment of setup.sh. `./lint.sh --fix` repairs what can be.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
if [ "${1:-}" = --fix ]; then
  .venv/bin/python -m ruff check --fix .
  .venv/bin/python -m ruff format .
else
  .venv/bin/python -m ruff check .
  .venv/bin/python -m ruff format --check .
fi
.venv/bin/python -m mypy
example="$(mktemp -d)/readme.py"
sed -n '/^```python$/,/^```$/{//!p}' README.md >"$example"
.venv/bin/python -m mypy "$example"
