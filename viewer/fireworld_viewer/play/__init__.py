"""A page that plays: one run, or two side by side, in a file that needs nothing else."""
