"""The recorder: records to MCAP logs and back."""
