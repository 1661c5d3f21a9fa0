"""A section of quadrilaterals carried along the track into hexahedra."""
