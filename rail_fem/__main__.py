"""python -m rail_fem: see rail_fem/cli.py."""

from rail_fem.cli import main

if __name__ == "__main__":
    main()
