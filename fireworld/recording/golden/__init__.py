"""Golden recordings: stored, run again, compared."""
