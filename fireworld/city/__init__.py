"""The city: what is fixed during an episode."""
