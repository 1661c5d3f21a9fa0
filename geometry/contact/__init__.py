"""Closest points and gaps between a wheelset and its rails, prismatic or lofted, and what follows from them."""
