"""docs/scenarios.md: the table of the shipped scenarios, and the check it shows, are what the command writes."""

import pytest

from tests.docs.contested_table import PAGE, renew
from tests.docs.pages import fenced


@pytest.mark.heavy
def test_the_table_of_the_shipped_scenarios_is_what_is_found():
    page = PAGE.read_text(encoding="utf-8")
    assert renew(page) == page


def test_the_check_that_is_shown_is_what_is_printed(fireworld, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    (shown,) = (block for block in fenced(PAGE, "text") if block.startswith("test-1\n"))
    assert fireworld("scenarios", "check", "test-1").out.startswith(shown)


def test_its_python_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for block in fenced(PAGE, "python"):
        exec(compile(block, str(PAGE), "exec"), {})  # noqa: S102 - what a reader would type
