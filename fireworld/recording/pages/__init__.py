"""Recordings as pages and pictures: the one place below the command line that reaches the viewer."""
