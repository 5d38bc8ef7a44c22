"""The notebook runs from an empty folder, shows tables and a map, and is kept without what it shows."""

from __future__ import annotations

import asyncio

import pytest

from tests.docs.pages import ROOT

nbformat = pytest.importorskip("nbformat", reason="nbclient and ipykernel are not installed")
nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed")
pytest.importorskip("ipykernel", reason="ipykernel is not installed")
NOTEBOOK = ROOT / "examples" / "first-fire.ipynb"


@pytest.fixture
def cells():
    return [cell for cell in nbformat.read(NOTEBOOK, as_version=4).cells if cell.cell_type == "code"]


def test_it_is_kept_without_outputs(cells):
    assert len(cells) > 8
    assert all(cell.outputs == [] and cell.execution_count is None for cell in cells)
    nbformat.validate(nbformat.read(NOTEBOOK, as_version=4))


@pytest.mark.heavy
@pytest.mark.filterwarnings("ignore")
def test_it_runs_and_everything_shows_itself(here):
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    client = nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(here)}})
    asyncio.run(client.async_execute())
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    shown = [{kind for out in cell.outputs for kind in out.get("data", {})} for cell in code]
    assert {"text/html"} <= set().union(*shown)
    by_last_line = {cell.source.splitlines()[-1]: kinds for cell, kinds in zip(code, shown, strict=True)}
    for line in ("lost", "saved", "fw.diff(lost, saved)", "team", 'fw.run("quick", policy=most_fuel)'):
        assert "text/html" in by_last_line[line], line
    assert by_last_line["lost.show(30)"] & {"image/png", "image/svg+xml", "text/html"}
    printed = "".join(out.text for cell in code for out in cell.outputs if out.output_type == "stream")
    assert "best: " in printed
    assert "burned at most, 0 at the end" in printed
