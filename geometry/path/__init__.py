"""The path of a rigid wheel over a running surface."""
