"""What the light models stand on: rigid paths, contact tables, load sharing, plastic indentation, masses, springs and
dampers."""
