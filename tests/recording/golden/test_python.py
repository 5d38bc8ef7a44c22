"""Golden recordings from Python: what the commands do, as functions."""

from __future__ import annotations

import pytest

from fireworld.errors import LogError, OutputError
from fireworld.recording.golden.check import check_goldens
from fireworld.recording.golden.update import add_golden, update_goldens


def test_add_check_update(here, change_policy):
    path = add_golden("quick", policy="mine:Policy", steps=5, settings={"brigades.n": 3}, folder=here / "kept")
    assert path == here / "kept" / "quick-mine-Policy.mcap"
    (result,) = check_goldens(here / "kept")
    assert (result.result, result.to_dict()["totals"][0]["n_steps"]) == ("same", 6)
    assert repr(result) == "<GoldenResult quick-mine-Policy: same>"
    change_policy("EASIEST")
    (result,) = check_goldens(here / "kept", keep=here / "new")
    assert result.differs
    assert "step 1, choose: brigade 0 chose easiest, was nearest-to-me" in repr(result)
    assert (here / "new" / path.name).is_file()
    seen = []
    (update,) = update_goldens(here / "kept", reason="The easiest first.", on_result=seen.append)
    assert (update.done, update.sentence) == ("recording", result.sentence)
    assert [one.name for one in seen] == ["quick-mine-Policy"]
    assert [one.result for one in check_goldens(here / "kept")] == ["same"]


def test_mistakes_are_found_before_anything_is_run(here):
    with pytest.raises(OutputError, match="expected a folder of goldens"):
        check_goldens(here / "kept")  # not only when it is iterated over
    add_golden("quick", policy="random", steps=2, folder=here / "kept")
    with pytest.raises(OutputError, match="another folder than that of the goldens"):
        check_goldens(here / "kept", keep=here / "kept")
    with pytest.raises(OutputError, match="reason: expected a sentence"):
        update_goldens(here / "kept", reason=" ")
    with pytest.raises(OutputError, match="an existing golden"):
        add_golden("quick", policy="random", steps=2, folder=here / "kept")


def test_all_that_cannot_be_run_are_counted(here, write_policy):
    for name in ("one", "two"):
        add_golden("quick", policy="mine:Policy", steps=2, name=name, folder=here / "kept")
    before = {path.name: path.read_bytes() for path in (here / "kept").iterdir()}
    write_policy("")
    with pytest.raises(LogError, match=r"^one: .*; 1 more cannot be run; nothing is updated$"):
        update_goldens(here / "kept", reason="Tidied up.")
    assert {path.name: path.read_bytes() for path in (here / "kept").iterdir()} == before
