#!/bin/bash
# Whether the outside links of the documents answer (docs/_build/links/output.txt); without a network it says so and ends well.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
docs/build.sh --only-environment
.venv/bin/python -m sphinx -q -b linkcheck -D plot_gallery=0 docs docs/_build/links >/dev/null 2>&1 || true
exec .venv/bin/python docs/_ext/links.py docs/_build/links/output.json
