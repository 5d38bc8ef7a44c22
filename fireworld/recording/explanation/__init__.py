"""Which decisions make the difference between the scores of two recorded runs."""
