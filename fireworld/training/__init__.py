"""Training: curricula, the paper's method and its variants, and the teams that come of it."""
