"""Over many runs: sweeps, comparison of rungs, trends, pages."""
