"""Closed forms and tables of elastic contact."""
