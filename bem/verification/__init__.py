"""Exact problems, observed orders, and commands that show them."""
