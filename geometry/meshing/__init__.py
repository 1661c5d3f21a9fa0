"""Hexahedral meshes of crossing and wheel."""
