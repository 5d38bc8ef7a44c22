"""Conformance: the engine against traces of another fire simulator, given that simulator's own inputs."""
