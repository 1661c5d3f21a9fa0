"""Elastoplastic half-space: plastic strain as eigenstrain in cuboids, J2 with hardening, contact and rolling."""
