"""python -m rail_fem: the command line of rail_fem/cli.py, where the environment holds what it needs; else a
sentence."""

import logging
import os
import sys

from rail_fem.processes import stopping
from rail_fem.run.installation import REMEDY, explain, numpy_mismatch


def main() -> None:
    """The program; ready to be stopped before the long imports, and with a sentence where a library is missing."""
    stopping.listen()
    logging.getLogger(__package__).propagate = False  # the terminal has words of its own; ffcx sets a handler for all
    logging.disable(logging.INFO)  # the compiler's own account of dolfinx's forms and elements
    os.environ["PYTHONSAFEPATH"] = "1"  # of every process that this one starts: nothing from the current folder
    if sys.argv[1:] in (["doctor"], ["doctor", "--json"]):  # speaks also where the command line cannot be imported
        from rail_fem.run.doctor import tell

        sys.exit(tell(as_json="--json" in sys.argv))
    if mismatch := numpy_mismatch():
        sys.exit(f"rail-fem: {mismatch}: {REMEDY}")
    try:
        from rail_fem.cli import main as command_line

        command_line()
    except (ImportError, AttributeError) as error:  # the latter where a package's folder was emptied
        if not (sentence := explain(error)):
            raise
        sys.exit(f"rail-fem: {sentence}")


if __name__ == "__main__":
    main()
