"""Values that do not fit the city are refused as they are read, by one line, in every way of reading."""

import dataclasses

import numpy as np
import pytest
from fireworld_recorder.reader import open_log
from fireworld_recorder.writer import LogWriter

import fireworld as fw
from fireworld.errors import LogError
from tests.recorder import synthetic

CHANGES = [
    ("buildings", "fieryness", lambda column: np.full(len(column), 99, dtype=np.uint8), "99 is none of 9 names"),
    ("buildings", "energy", lambda column: column[:-1], "entries, where the city has"),
    ("buildings", "energy", lambda column: np.full(len(column), np.nan), "a value is no number"),
    ("buildings", "water_litres", lambda column: column[:0], "0 entries, where the city has"),
    ("brigades", "hp", lambda column: np.concatenate([column, column]), "entries, where the city has"),
    ("brigades", "activity", lambda column: np.full(len(column), 17, dtype=np.uint8), "17 is none of 6 names"),
    ("civilians", "hp", lambda column: column[:0], "0 entries, where the city has"),
    ("events", "entity", lambda column: np.zeros(len(column) + 3, dtype=np.int32), "entries, where others have"),
    ("brigades", "x_m", lambda column: np.full(len(column), -1e300), r"a place more than 1e\+08 m away"),
    ("score", "score", lambda _: float("inf"), "inf is no number"),
]


@pytest.mark.parametrize(("topic", "field", "change", "message"), CHANGES)
def test_a_step_that_does_not_fit(tmp_path, topic, field, change, message):
    city = synthetic.city()
    steps = synthetic.run(4, city_record=city)
    with LogWriter(tmp_path / "a.mcap", synthetic.header(), city) as writer:
        for step in steps:
            if step.step == 2:
                part = getattr(step, topic)
                part = dataclasses.replace(part, **{field: change(getattr(part, field))})
                writer.write(dataclasses.replace(step, **{topic: part}))
            else:
                writer.write(step)
    log = open_log(tmp_path / "a.mcap")
    assert log.step(1).step == 1
    with pytest.raises(LogError, match=f"a.mcap: step 2: /{topic}: .*{message}"):
        log.step(2)
    with pytest.raises(LogError, match=f"step 2: /{topic}: .*{message}"):
        list(log)


def test_a_city_that_does_not_fit_itself(tmp_path):
    city = synthetic.city()
    for changed, message in [
        ({"link_ptr": city.link_ptr + 1}, "link_ptr: it does not divide"),
        ({"floors": city.floors[:-1]}, "floors: .* entries, where the city has"),
        ({"center_x_m": np.full(len(city.center_x_m), np.inf)}, "center_x_m: a value is no number"),
        ({"material": np.full(len(city.material), 8, dtype=np.uint8)}, "material: 8 is none of 3 names"),
    ]:
        other = dataclasses.replace(city, **changed)
        with LogWriter(tmp_path / "a.mcap", synthetic.header(), other, force=True) as log:
            for step in synthetic.run(1, city_record=city):
                log.write(step)
        with pytest.raises(LogError, match=f"a.mcap: /city: {message}"):
            open_log(tmp_path / "a.mcap")


@pytest.mark.slow
@pytest.mark.parametrize(("field", "value"), [("action", 77), ("action", -9), ("target", 10**6), ("target", -7)])
def test_choices_of_another_version_are_shown(tmp_path, fireworld, field, value):
    """Later versions may add actions; a target that there is not is none."""
    log = fw.run("quick", policy="chief", steps=6, record=tmp_path / "a.mcap")
    path = tmp_path / "other.mcap"
    with LogWriter(path, log.header, log.city) as writer:
        for step in log:
            column = np.array(getattr(step.decisions, field))
            column[:1] = value
            writer.write(dataclasses.replace(step, decisions=dataclasses.replace(step.decisions, **{field: column})))
    for words in (
        ("info", path),
        ("diff", tmp_path / "a.mcap", path, "--html", tmp_path / "d.html"),
        ("report", path, "-o", tmp_path / "r.html"),
        ("report", tmp_path / "a.mcap", path, "-o", tmp_path / "two.html"),
        ("render", path, "-o", tmp_path / "p.png"),
        ("view", path, "--save", tmp_path / "v.rrd"),
        ("export", path, "--parquet", tmp_path / "tables"),
        ("verify", path),
        ("explain", tmp_path / "a.mcap", path),
        ("fork", path, "--at", 5, "--policy", "chief"),
    ):
        done = fireworld(*words)
        assert "internal error" not in done.err, words
        assert done.code == (1 if words[0] in {"diff", "verify"} else done.code), (words, done)
    assert (tmp_path / "v.rrd").exists()
    assert (tmp_path / "p.png").exists()


@pytest.mark.parametrize("field", ["action", "target"])
def test_actions_and_targets_go_together(tmp_path, field):
    city, path = synthetic.city(), tmp_path / "a.mcap"
    with LogWriter(path, synthetic.header(), city) as log:
        for step in synthetic.run(2, city_record=city):
            empty = np.zeros(0, dtype=np.int32)
            log.write(dataclasses.replace(step, decisions=dataclasses.replace(step.decisions, **{field: empty})))
    with pytest.raises(LogError, match=r"/decisions: \d+ actions and \d+ targets"):
        list(open_log(path))
