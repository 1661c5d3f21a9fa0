"""Steel at a point: hardening, the J2 return, laws over many cycles, loading paths."""
