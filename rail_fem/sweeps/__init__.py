"""Over many runs: sweeps, comparison of models, trends, pages."""
