"""Elastic contact in NumPy and SciPy: closed forms, kernels, boundary elements. Knows nothing of rails."""
