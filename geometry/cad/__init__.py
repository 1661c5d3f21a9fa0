"""Crossings from and to CAD: STEP files through Gmsh's OpenCASCADE, in Gmsh's own process."""
