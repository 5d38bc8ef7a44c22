"""A run in words and numbers: what was chosen, what happened."""
