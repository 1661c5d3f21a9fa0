"""A plane cross-section filled with quadrilaterals."""
