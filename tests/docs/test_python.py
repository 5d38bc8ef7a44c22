"""docs/python.md: it names the front door."""

import fireworld as fw
from tests.docs.pages import ROOT

PAGE = ROOT / "docs" / "python.md"


def test_it_names_every_function_of_the_front_door():
    text = PAGE.read_text(encoding="utf-8")
    functions = [name for name in fw.__all__ if name[0].islower() and callable(getattr(fw, name))]
    assert [name for name in functions if f"fw.{name}" not in text] == []
