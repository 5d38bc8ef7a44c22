"""Team files: written and read again, followed as a policy, and every fault in one line."""

from __future__ import annotations

import json
import zipfile

import numpy as np
import pytest

from fireworld.errors import TrainingError
from fireworld.policy.names import find_policy, note_on_team
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.teams.team import FORMAT, load_team


def make_team(n_tables=2, n_states=270, **provenance):
    tables = np.random.default_rng(3).normal(size=(n_tables, n_states, 4))
    return TableTeam(tables, (tables > 0).astype(np.int64), provenance)


def test_written_and_read_again(tmp_path):
    team = make_team(seed=4, method={"commit": 3})
    team.save(tmp_path / "a.npz")
    team.save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes() == team.to_bytes()
    read = load_team(tmp_path / "a.npz")
    np.testing.assert_array_equal(read.tables, team.tables)
    np.testing.assert_array_equal(read.visits, team.visits)
    assert (read.digest, read.provenance, read.commit) == (team.digest, {"seed": 4, "method": {"commit": 3}}, 3)
    with np.load(tmp_path / "a.npz") as opened:
        np.testing.assert_array_equal(opened["tables"], team.tables)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npz", "b.npz"]


def test_it_is_a_policy_by_its_path(tmp_path):
    make_team(method={"commit": 3}).save(tmp_path / "team.npz")
    named = find_policy(str(tmp_path / "team.npz"))
    assert named.name == "team.npz", "a recording names no folder"
    assert named.policy.commit == 3
    assert named.attachments == {"policy.npz": (tmp_path / "team.npz").read_bytes()}
    assert named.digest == make_team(method={"commit": 3}).policy().digest


@pytest.mark.parametrize(
    ("n_tables", "n_brigades", "note"),
    [
        (1, 4, ""),
        (4, 4, ""),
        (2, 4, "team.npz: 2 tables for 4 brigades: brigade b follows table b modulo 2"),
        (4, 3, "team.npz: 4 tables for 3 brigades: the last 1 are not used"),
    ],
)
def test_tables_are_spread_over_brigades(tmp_path, n_tables, n_brigades, note):
    team = make_team(n_tables)
    team.save(tmp_path / "team.npz")
    named = find_policy(str(tmp_path / "team.npz"))
    assert note_on_team(named, n_brigades) == note
    spread = named.policy.for_brigades(n_brigades)
    assert spread.table_of.tolist() == [brigade % n_tables for brigade in range(n_brigades)]


def test_no_note_on_other_policies():
    assert note_on_team(find_policy("each-another"), 7) == ""


HEADER = {"format": FORMAT, "kind": "tables", "provenance": {}}


def write(path, header=None, **arrays):
    """Write a team file with something else in it."""
    team = make_team()
    text = json.dumps(HEADER if header is None else header).encode()
    content = {"header": np.frombuffer(text, dtype=np.uint8), "tables": team.tables, "visits": team.visits, **arrays}
    np.savez(path, **{name: array for name, array in content.items() if array is not None})


def with_nan():
    tables = make_team().tables.copy()
    tables[1, 17, 2] = np.nan
    return tables


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"header": {"format": "fireworld-team/3"}}, "format: expected fireworld-team/2"),
        ({"header": {"format": "fireworld-team/3"}}, r"got 'fireworld-team/3'; made by a later fireworld\?$"),
        ({"header": {}}, "format: expected fireworld-team/2, got None$"),
        ({"header": [1]}, "got None$"),
        ({"header": HEADER | {"kind": "forest"}}, "one of network, ranking, tables, got 'forest'; made by"),
        ({"header": HEADER | {"kind": ["tables"]}}, r"one of network, ranking, tables, got \['tables'\]"),
        ({"header": HEADER | {"provenance": 3}}, "provenance: expected keys and values, got 3$"),
        ({"header": HEADER | {"provenance": {"method": {"commit": "x"}}}}, "method.commit: expected a whole number"),
        ({"header": HEADER | {"provenance": {"method": {"commit": 0}}}}, "method.commit: .*got 0$"),
        ({"header": HEADER | {"provenance": {"method": 7}}}, "method.commit: .*got None$"),
        ({"header": {"format": "fireworld-team/1", "method": {"commit": "x"}}}, "method.commit: expected a whole"),
        ({"header": {"format": "fireworld-team/1", "method": {"commit": 0}}}, "method.commit: .*got 0$"),
        ({"header": {"format": "fireworld-team/1", "method": 7}}, "method.commit: .*got None$"),
        ({"tables": with_nan()}, r"tables\[1, 17, 2\]: expected a finite number, got nan$"),
        ({"tables": np.zeros((2, 4320, 3))}, r"tables: expected float64 tables of .*, got float64 \(2, 4320, 3\)"),
        ({"tables": np.zeros((2, 1000, 4))}, r"got float64 \(2, 1000, 4\)"),
        ({"tables": np.zeros((0, 270, 4))}, r"got float64 \(0, 270, 4\)"),
        ({"tables": np.zeros((2, 270, 4), dtype=np.float32)}, "got float32"),
        ({"tables": np.zeros((270, 4))}, r"got float64 \(270, 4\)"),
        ({"tables": None}, "expected a team file, got no tables in it"),
        (
            {"visits": np.zeros((1, 270, 4), dtype=np.int64)},
            r"visits: expected int64 visits >= 0 of shape \(2, 270, 4\)",
        ),
        ({"visits": np.full((2, 270, 4), -1)}, "visits: expected int64 visits >= 0"),
        ({"visits": np.array([{}])}, "ValueError: Object arrays cannot be loaded"),
    ],
)
def test_what_is_wrong_with_a_team_file(tmp_path, changes, message):
    write(tmp_path / "bad.npz", **changes)
    with pytest.raises(TrainingError, match=message) as caught:
        find_policy(str(tmp_path / "bad.npz"))
    assert str(caught.value).startswith(f"{tmp_path / 'bad.npz'}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not really", b"{}"])
def test_no_team_file_at_all(tmp_path, content):
    (tmp_path / "bad.npz").write_bytes(content)
    with pytest.raises(TrainingError, match=r"expected a team file \(.npz\), got BadZipFile"):
        load_team(tmp_path / "bad.npz")


def test_a_damaged_team_file(tmp_path):
    make_team().save(tmp_path / "a.npz")
    good = bytearray((tmp_path / "a.npz").read_bytes())
    for place in range(60, len(good) - 60, 97):
        bad = good.copy()
        bad[place] ^= 0x5A
        (tmp_path / "bad.npz").write_bytes(bad)
        try:
            read = load_team(tmp_path / "bad.npz")
        except TrainingError:
            continue
        np.testing.assert_array_equal(read.tables, make_team().tables)


def test_a_broken_header_and_an_absent_file(tmp_path):
    write(tmp_path / "bad.npz", header=None)
    with zipfile.ZipFile(tmp_path / "bad.npz", "r") as archive:
        assert "header.npy" in archive.namelist()
    np.savez(tmp_path / "bad.npz", header=np.frombuffer(b"{", np.uint8), tables=[0], visits=[0])
    with pytest.raises(TrainingError, match="header: expected JSON"):
        load_team(tmp_path / "bad.npz")
    with pytest.raises(TrainingError, match="expected a team file, got No such file or directory"):
        find_policy(str(tmp_path / "absent.npz"))
