"""Pictures and films with matplotlib; whatever draws raises ViewError where matplotlib is not installed."""
