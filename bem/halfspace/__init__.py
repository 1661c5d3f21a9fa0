"""Three-dimensional contact of half-spaces: normal, tangential, rolling, subsurface."""
