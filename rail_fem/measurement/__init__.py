"""Measured records beside results: reading, filtering alike, alignment by position, scores, one figure."""
