"""Progress is shown to people who watch, and to nobody else."""

from __future__ import annotations

import io
from contextlib import redirect_stderr

import pytest

from fireworld.cli.progress import BAR, COUNT, DESCRIPTION, bar, bars, is_watched


class Stream(io.StringIO):
    """An error stream of the tests, at which people sit or not."""

    def __init__(self, *, watched):
        super().__init__()
        self.watched = watched

    def isatty(self):
        return self.watched


@pytest.fixture
def terminal(monkeypatch):
    """Let nothing but the stream itself say whether somebody watches."""
    for name in ("FORCE_COLOR", "NO_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "80")


def test_a_bar_counts_what_is_done_and_goes_away(terminal, capsys):
    with redirect_stderr(Stream(watched=True)) as stream:
        assert is_watched()
        with bar("eggs", 3, DESCRIPTION, "today", BAR, COUNT) as advance:
            advance()
            advance()
    shown = stream.getvalue()
    assert "eggs today" in shown
    assert "2/3" in shown
    assert shown.endswith("\x1b[2K"), "the line is erased"
    assert capsys.readouterr().out == ""


def test_bars_say_what_their_tasks_tell(terminal):
    with (
        redirect_stderr(Stream(watched=True)) as stream,
        bars("{task.completed:.0f} of at most {task.total:.0f}", "{task.fields[state]}") as progress,
    ):
        task = progress.add_task("eggs", total=7, state="boiling")
        progress.update(task, completed=4, state="done")
    assert "4 of at most 7 done" in stream.getvalue()


@pytest.mark.parametrize(("watched", "quiet"), [(False, False), (True, True)])
def test_nobody_is_bothered(terminal, watched, quiet):
    with redirect_stderr(Stream(watched=watched)) as stream:
        assert is_watched() == watched
        with bar("eggs", 3, quiet=quiet) as advance:
            advance()
        with bars(quiet=quiet) as progress:
            progress.advance(progress.add_task("eggs", total=1))
    assert stream.getvalue() == ""
