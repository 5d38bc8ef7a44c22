"""The page on archives: its example runs, and its table lists the tables there are."""

import contextlib
import re

from fireworld_recorder.tables import TABLES

from tests.docs.pages import ROOT
from tests.recorder import synthetic
from tests.recorder.conftest import write_log

PAGE = (ROOT / "docs" / "archive.md").read_text(encoding="utf-8")


def test_the_example_of_arrays_runs(tmp_path):
    write_log(tmp_path / "run.mcap", synthetic.run(4))
    (example,) = re.findall(r"<!-- tested -->\n```python\n(.*?)```", PAGE, re.DOTALL)
    found = {}
    with contextlib.chdir(tmp_path):
        exec(example, found)  # noqa: S102 - our own page
    assert found["temperature"].shape == (5, 12)
    assert found["score"].tolist() == [4.5] * 5
    assert [len(sites) for sites in found["sites"]] == [0, 2, 1, 2, 1]
    assert found["step"].step == 3
    assert 0 <= found["hottest"] < 12


def test_every_table_is_listed():
    assert set(re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE)) == set(TABLES)
