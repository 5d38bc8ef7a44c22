"""The page on archives: its table lists the tables there are."""

import re

from fireworld_recorder.tables import TABLES

from tests.docs.pages import ROOT

PAGE = (ROOT / "docs" / "archive.md").read_text(encoding="utf-8")


def test_every_table_is_listed():
    assert set(re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE)) == set(TABLES)
