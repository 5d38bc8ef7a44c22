"""A small trace with its city, and the command line, for all tests of conformance."""

import json

import numpy as np
import pytest

from tests import command_line
from tests.reference.traces import CITIES, TRACES


def city_path(name):
    return TRACES / f"{CITIES[name]}.json"


def trace_path(name):
    return TRACES / f"{name}.npz"


def trace_arrays(name):
    with np.load(trace_path(name)) as stored:
        return dict(stored)


@pytest.fixture
def write(tmp_path):
    """Write a trace of `mini`, or another one, with some arrays changed or (None) left out; return its path."""

    def write_trace(name="mini", **changes):
        arrays = trace_arrays(name) | changes
        path = tmp_path / "changed.npz"
        np.savez(path, **{key: value for key, value in arrays.items() if value is not None})
        return path

    return write_trace


@pytest.fixture
def write_city(tmp_path):
    """Write a city file with some keys changed; return its path."""

    def write_document(name="mini", **changes):
        path = tmp_path / "changed.json"
        path.write_text(json.dumps(json.loads(city_path(name).read_text()) | changes))
        return path

    return write_document


@pytest.fixture
def run_cli(monkeypatch):
    """Call `fireworld conformance`; return exit code, output and error output."""

    def call(*arguments):
        done = command_line.call(monkeypatch, "conformance", *arguments)
        return done.code, done.out, done.err

    return call
