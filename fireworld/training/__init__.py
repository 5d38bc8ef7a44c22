"""Training: curricula, the methods by which teams learn, and the function `train`."""
