"""Static finite elements, plane and solid: independent judges of the boundary elements."""
