"""Evaluation: what policies achieve, compared honestly, as tables and figures."""
