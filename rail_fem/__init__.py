"""What happens when a wheel passes a crossing: one scene, a ladder of models, an honest error on each rung."""
