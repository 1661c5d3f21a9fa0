"""Plane problems by indirect boundary elements, with friction."""
