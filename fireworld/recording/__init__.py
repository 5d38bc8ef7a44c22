"""Forks: what would have happened if, from some step of a recorded run on, somebody had decided otherwise."""
