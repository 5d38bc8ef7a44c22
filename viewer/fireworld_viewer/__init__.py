"""The viewer: recordings to Rerun."""
