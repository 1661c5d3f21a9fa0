"""Figures of a run, made without a display: matplotlib draws, meshio reads the fields. VTK stays out of this package:
in one process with numba's LLVM its scalar bars crash, so three-dimensional pictures belong in scripts such as
cases/plot_plastic_strain.py."""
