"""A synthetic run and its log, shared by the tests of the recorder."""

import pytest
from fireworld_recorder.writer import LogWriter

from tests import command_line
from tests.recorder import synthetic


def write_log(path, records, *, header=None, city=None, force=False):
    """Write records to a log and return its path."""
    with LogWriter(path, header or synthetic.header(), city or synthetic.city(), force=force) as log:
        for record in records:
            log.write(record)
    return path


@pytest.fixture(scope="session")
def city():
    return synthetic.city()


@pytest.fixture(scope="session")
def records(city):
    return synthetic.run(30, city_record=city)


@pytest.fixture(scope="session")
def log_path(tmp_path_factory, records, city):
    """A complete log of 31 steps with snapshots after 10, 20 and 30."""
    return write_log(tmp_path_factory.mktemp("logs") / "run.mcap", records, city=city)


@pytest.fixture(scope="session")
def small_log(tmp_path_factory, records, city):
    """The bytes of a complete log of 7 steps."""
    return write_log(tmp_path_factory.mktemp("logs") / "small.mcap", records[:7], city=city).read_bytes()


@pytest.fixture
def run_cli(monkeypatch):
    """Call the command line; return exit code, output and error output."""

    def call(*arguments):
        monkeypatch.setenv("COLUMNS", "120")
        done = command_line.call(monkeypatch, *arguments)
        return done.code, done.out, done.err

    return call
