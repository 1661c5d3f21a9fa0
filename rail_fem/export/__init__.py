"""Results out of a run folder, to dolfinx and to files of other programs; meshes of Gmsh in."""
