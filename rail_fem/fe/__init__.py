"""Explicit elastoplastic dynamics on dolfinx meshes: the only part that uses dolfinx and MPI."""
