"""docs/datasets.md: its example runs, and it names every column and file."""

import pyarrow.parquet as pq

from fireworld.envs.datasets.rlds import FILES
from tests.docs.pages import ROOT, fenced

PAGE = ROOT / "docs" / "datasets.md"


def test_its_example_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "docs_datasets"}
    for block in fenced(PAGE, "python"):
        exec(compile(block, str(PAGE), "exec"), names)  # noqa: S102 - what a reader would type
    assert len(names["dataset"]) > 3
    text = PAGE.read_text(encoding="utf-8")
    assert [name for name in FILES if f"`{name}.parquet`" not in text] == []
    columns = pq.read_schema(tmp_path / "dataset" / "steps.parquet").names
    first, last = columns.index("free_edges"), columns.index("others_nearest_to_me")
    ranged = {*columns[first:last], *(name for name in columns if name.startswith("team_"))}
    assert [name for name in columns if name not in ranged and f"`{name}`" not in text] == []
