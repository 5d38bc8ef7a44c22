"""docs/readings.md: what it says was found is what the kept runs come to, by the command that it names."""

from __future__ import annotations

import re
import shutil

import pytest

import fireworld as fw
from fireworld.reproduction.readings.report import CURVE, EFFECTS, MARKDOWN
from fireworld.reproduction.readings.runs import RUNS, SETTINGS
from tests.docs.readings_result import KEPT, PAGE, renew

TEXT = PAGE.read_text(encoding="utf-8")
WORDS = r"^fireworld reproduce --readings(?: --repetitions (\d+))? --out docs/readings --resume"
COMMAND = re.compile(WORDS, re.MULTILINE)


@pytest.mark.slow
def test_it_follows_from_the_runs(tmp_path):
    command = COMMAND.search(TEXT)
    assert command is not None
    for name in (RUNS, SETTINGS):
        shutil.copy(KEPT / name, tmp_path)
    found = fw.try_readings(tmp_path, repetitions=int(command[1]) if command[1] else None, resume=True)
    assert not found.study.timing.total, "nothing is tried again"
    for name in (RUNS, EFFECTS, CURVE, MARKDOWN):
        assert (tmp_path / name).read_bytes() == (KEPT / name).read_bytes()
    assert renew(TEXT, (KEPT / MARKDOWN).read_text(encoding="utf-8")) == TEXT
