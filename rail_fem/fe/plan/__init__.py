"""What can be known of an explicit run before anything is meshed; nothing here needs dolfinx."""
