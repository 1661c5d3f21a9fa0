"""Elastic contact in NumPy and SciPy: closed forms, kernels, boundary elements. Knows nothing of rails.

Reading order of the plane problems: material, hertz and subsurface (closed forms); kelvin (kernels); curve, outline, mesh;
boundary (one body), internal (its fields); body, pairing, coulomb, contact (two bodies); rolling;
exact_problems and orders (errors against exact solutions), study (convergence, speed, memory).
"""
