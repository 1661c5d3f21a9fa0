"""Running surfaces that change along the track: crossings, switches, bodies lofted through sections."""
