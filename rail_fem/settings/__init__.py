"""Numerical settings of the models."""
