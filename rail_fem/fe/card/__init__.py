"""A pass on a graphics card: arrays there, what its threads do, a step as launches, copies where somebody looks."""
