"""A flight recorder, replayer and test bench for teams of fire brigades."""

__version__ = "0.1.0"
