"""Contact of prisms by slices: the 2.5D boundary element method."""
