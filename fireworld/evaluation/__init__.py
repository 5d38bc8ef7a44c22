"""Evaluation: what policies achieve over many seeds, compared run by run."""
