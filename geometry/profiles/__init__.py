"""Wheel and rail profiles: arcs and tables, measured files, what is wrong with them and how it is repaired."""
