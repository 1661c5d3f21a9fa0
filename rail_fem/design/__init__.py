"""Search for a better crossing: what may vary, what is wanted over which wheels and speeds, the search, its report."""
