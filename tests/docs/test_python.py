"""docs/python.md: its examples run, one after another, and it names the front door."""

import fireworld as fw
from tests.docs.pages import ROOT, fenced

PAGE = ROOT / "docs" / "python.md"


def test_its_examples_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "docs_python"}
    for block in fenced(PAGE, "python"):
        exec(compile(block, str(PAGE), "exec"), names)  # noqa: S102 - what a reader would type
    assert names["difference"].first.step == 1
    assert not names["difference"].same
    assert names["world"].step_number == names["ahead"].step_number - 1


def test_it_names_every_function_of_the_front_door():
    text = PAGE.read_text(encoding="utf-8")
    functions = [name for name in fw.__all__ if name[0].islower() and callable(getattr(fw, name))]
    assert [name for name in functions if f"fw.{name}" not in text] == []
