"""Plane elastodynamics and impact: bodies of the plane boundary elements with inertia in cells, and in Laplace's
domain.

Reading order: cells, body_force (a cell's field), body (flexibility of a body for its inertia forces and its loads),
schemes and marching (steps in time); pivoting (contact in a step) and impact (a mass or a prescribed motion strikes
the body, with friction)."""
