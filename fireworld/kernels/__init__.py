"""Compiled kernels: plain functions of arrays."""
