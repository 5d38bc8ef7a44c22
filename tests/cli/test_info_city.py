"""`fireworld info` of a city file."""

from __future__ import annotations

import json

CITY = {
    "name": "two",
    "source": {"map": "drawn by hand", "licence": {"name": "CC0"}, "odd\nkey": 1},
    "buildings": [
        {"id": 3, "apexes": [0, 0, 10000, 0, 10000, 6000, 0, 6000, 0, 0]},
        {"id": 4, "type": "refuge", "apexes": [20000, 0, 30000, 0, 24000, 9000, 26000, 9000]},
    ],
    "streets": {"nodes": [[0, -4000], [30000, -4000]], "edges": [[0, 1]]},
}
LINES = """\
city         two, 30 m by 9 m
buildings    2: 1 can burn, 1 are refuges; 9 corners, 96 m2
streets      1 between 2 nodes, 0 hydrants
source       map: drawn by hand
             licence: {"name": "CC0"}
             odd\\nkey: 1
note         outlines that cross or touch themselves: building 4; the even-odd rule says what is inside
"""


def test_a_city_is_shown(here, fireworld):
    (here / "two.json").write_text(json.dumps(CITY))
    shown = fireworld("info", "two.json")
    assert (shown.code, shown.out) == (0, LINES)


def test_a_city_as_json(here, fireworld):
    (here / "two.json").write_text(json.dumps(CITY))
    found = json.loads(fireworld("info", "two.json", "--json").out)
    assert found["source"] == CITY["source"]
    assert found["extent_m"] == [30.0, 9.0]
    assert (found["n_buildings"], found["n_corners"], found["n_streets"], len(found["notes"])) == (2, 9, 1, 1)


def test_what_is_no_city_is_refused(here, fireworld):
    (here / "bad.json").write_text("{}")
    refused = fireworld("info", "bad.json")
    assert refused.code == 2
    assert "bad.json: buildings: expected this key to be there" in refused.err
    assert fireworld("info", "absent.json").code == 2
    assert "--schema and --proto go with logs" in fireworld("info", "bad.json", "--schema").err
