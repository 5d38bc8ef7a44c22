"""Pictures and films with matplotlib."""
