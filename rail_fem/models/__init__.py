"""The models of the hierarchy, one file each."""
