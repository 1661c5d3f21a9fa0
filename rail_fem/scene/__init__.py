"""What is there when a wheel passes a crossing: scene, steels, wheel profiles, units."""
