"""python -m rail_fem: see rail_fem/cli.py."""

import sys

from rail_fem import stopping


def main() -> None:
    """The program; ready to be stopped before the long imports, and with a sentence where a library is missing."""
    stopping.listen()
    try:
        from rail_fem import cli
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] in ("rail_fem", "bem", "geometry"):
            raise
        sys.exit(f"{error.name} is not installed in this Python ({sys.executable}): run ./setup.sh, or use .venv/bin/python")
    cli.main()


if __name__ == "__main__":
    main()
