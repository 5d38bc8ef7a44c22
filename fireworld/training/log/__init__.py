"""The training log: every step that a team learns from, written, read, replayed, verified and compared."""
