"""Recordings and trainings in Rerun."""
