"""A wheel on a rail: the rigid wheel's path, where it touches, the law of the force, how several contacts share it."""
