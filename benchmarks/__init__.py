"""Benchmarks: `python -m benchmarks.bench` prints a table of ratios, each taken within one run on one machine."""
