"""Golden recordings: kept, run again, compared."""
