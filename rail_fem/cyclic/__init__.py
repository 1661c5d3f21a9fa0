"""Cyclic plasticity at a point: laws with several back stresses, loading paths, and what many passes lead to."""
