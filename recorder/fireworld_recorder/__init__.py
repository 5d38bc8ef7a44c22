"""The recorder: records to MCAP logs and back; knows nothing of the simulator."""
