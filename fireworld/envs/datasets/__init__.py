"""Datasets for learners: what was seen, done and got in recorded episodes, written and loaded back."""
