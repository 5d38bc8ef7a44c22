"""Call the command line within the tests' own process."""

from __future__ import annotations

import contextlib
import io
import sys
from dataclasses import dataclass

import pytest

from fireworld.cli import main


@dataclass(frozen=True)
class Done:
    """What a command did."""

    code: int
    out: str
    err: str


def call(monkeypatch: pytest.MonkeyPatch, *words: object) -> Done:
    """Call `fireworld WORDS...`; nothing it can do may end in a traceback."""
    monkeypatch.setattr(sys, "argv", ["fireworld", *map(str, words)])
    out, err = io.StringIO(), io.StringIO()
    code = 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as stop:
            code = stop.code or 0
    assert "Traceback" not in err.getvalue()
    return Done(code, out.getvalue(), err.getvalue())
