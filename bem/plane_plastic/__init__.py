"""Plane plasticity by indirect boundary elements: initial stress in internal cells, only where the steel yields."""
