"""What the light models stand on: rigid paths, contact tables, load sharing, grooves, masses, springs and dampers."""
