"""The world: what a step changes, and the step itself."""
