"""Commands of the terminal that need no run: what there is, a case file to begin with, contact of a wheel and a rail,
studies."""
