"""Files of rankings: written and read again, followed by their path, and every fault in one line."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fireworld.errors import TrainingError
from fireworld.policy.names import find_policy, note_on_team
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.teams.team import FORMAT, load_team, parse_team, read_team, write_team
from tests.policy.test_ranking import NAMES, make_ranking


@pytest.mark.parametrize("own_targets", [False, True])
def test_written_and_read_again(tmp_path, own_targets):
    ranking = make_ranking(own_targets=own_targets, seed=4, method={"name": "search"})
    for name in ("a.npz", "b.npz"):
        ranking.save(tmp_path / name)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    read = load_team(tmp_path / "a.npz")
    np.testing.assert_array_equal(read.weights, ranking.weights)
    assert read.weights.dtype == np.float64
    assert (read.own_targets, read.digest, read.provenance) == (
        own_targets,
        ranking.digest,
        {"seed": 4, "method": {"name": "search"}},
    )
    with np.load(tmp_path / "a.npz") as opened:
        np.testing.assert_array_equal(opened["weights"], ranking.weights)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npz", "b.npz"]


def test_it_may_hold_more_arrays(tmp_path):
    write_team(make_ranking(), tmp_path / "a.npz", extra={"spread": np.ones(17)})
    ranking, more = read_team(tmp_path / "a.npz")
    assert list(more) == ["spread"]
    assert ranking.digest == make_ranking().digest


def test_it_is_a_policy_by_its_path(tmp_path):
    path = tmp_path / "mine.npz"
    make_ranking(3).save(path)
    named = find_policy(str(path))
    assert (named.name, named.trained_choices) == ("mine.npz", "")
    assert named.attachments == {"policy.npz": path.read_bytes()}
    assert named.digest == make_ranking(3).policy().digest
    assert note_on_team(named, 3) == ""
    assert "mine.npz: 3 " in note_on_team(named, 4)
    make_ranking(1).save(path, force=True)
    assert note_on_team(find_policy(str(path)), 4) == "", "one row is for all"


def test_team_files_of_tables_are_read_too(tmp_path):
    TableTeam(np.zeros((1, 270, 4)), np.zeros((1, 270, 4), dtype=np.int64)).save(tmp_path / "a.npz")
    assert isinstance(load_team(tmp_path / "a.npz"), TableTeam)


OLD_FORMAT = "fireworld-ranking/1"


def write(path, *, weights=None, left_out=(), **header):
    """Write the file of a ranking with something else in it."""
    new = {"format": FORMAT, "kind": "ranking", "provenance": {}}
    told = {**new, "weights": NAMES, "own_targets": True, **header}
    told = {key: value for key, value in told.items() if key not in left_out}
    arrays = {
        "header": np.frombuffer(json.dumps(told).encode(), dtype=np.uint8),
        "weights": make_ranking().weights if weights is None else weights,
    }
    np.savez(path, **{name: array for name, array in arrays.items() if f"array {name}" not in left_out})


def with_number(number):
    weights = make_ranking().weights
    weights[1, 3] = number
    return weights


SHAPE = r"weights: expected float64 weights of shape \(brigades, 17\), got "


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": 7}, "format: expected fireworld-.*, got 7$"),
        ({"left_out": ("format",)}, "format: expected fireworld-.*, got None$"),
        ({"weights": np.zeros((2, 16))}, SHAPE + r"float64 \(2, 16\)"),
        ({"weights": np.zeros(17)}, SHAPE + r"float64 \(17,\)"),
        ({"weights": np.zeros((0, 17))}, SHAPE + r"float64 \(0, 17\)"),
        ({"weights": np.zeros((2, 17), dtype=np.float32)}, SHAPE + r"float32 \(2, 17\)"),
        ({"weights": np.zeros((2, 17), dtype=np.int64)}, SHAPE + r"int64 \(2, 17\)"),
        ({"weights": np.array([{}])}, "ValueError: Object arrays cannot be loaded"),
        ({"weights": with_number(np.nan)}, r"weights\[1, 3\]: expected a finite number, got nan$"),
        ({"weights": with_number(-np.inf)}, r"weights\[1, 3\]: expected a finite number, got -inf$"),
        ({"left_out": ("weights",)}, "weights: expected temperature, volume, .*, got 'None'$"),
        ({"left_out": ("own_targets",)}, "own_targets: expected true or false, got None$"),
        ({"own_targets": 1}, "own_targets: expected true or false, got 1$"),
        ({"assigned": 1}, "assigned: expected true or false, and true only with own_targets, got 1$"),
        ({"assigned": True, "own_targets": False}, "assigned: expected true or false, and true only with own_targets"),
        ({"assigned": True}, "weights: expected one row, which all follow, got 2 rows$"),
        ({"left_out": ("array weights",)}, "expected a team file, got no weights in it$"),
        ({"left_out": ("array header",)}, "expected a team file, got no header in it$"),
    ],
)
@pytest.mark.parametrize("form", [FORMAT, OLD_FORMAT])
def test_what_is_wrong_with_a_file(tmp_path, form, changes, message):
    write(tmp_path / "bad.npz", **{"format": form, **changes})
    for read in (
        lambda: parse_team((tmp_path / "bad.npz").read_bytes(), source="bad"),
        lambda: find_policy(str(tmp_path / "bad.npz")),
    ):
        with pytest.raises(TrainingError, match=message) as caught:
            read()
        assert "bad" in str(caught.value).partition(":")[0]
        assert "\n" not in str(caught.value)


def test_a_file_of_a_later_format(tmp_path):
    write(tmp_path / "bad.npz", format="fireworld-ranking/2")
    message = r"^bad: format: expected fireworld-team/2, got 'fireworld-ranking/2'; made by a later fireworld\?$"
    with pytest.raises(TrainingError, match=message):
        parse_team((tmp_path / "bad.npz").read_bytes(), source="bad")
    with pytest.raises(TrainingError, match="got 'fireworld-ranking/2'"):
        find_policy(str(tmp_path / "bad.npz"))


@pytest.mark.parametrize("names", [NAMES[:-1], NAMES[::-1], [*NAMES, "smell"], "temperature", {"temperature": 1}])
def test_weights_of_something_else_are_refused(tmp_path, names):
    told = {"format": OLD_FORMAT, "weights": names, "own_targets": True}
    header = np.frombuffer(json.dumps(told).encode(), dtype=np.uint8)
    np.savez(tmp_path / "bad.npz", header=header, array=0, weights=make_ranking().weights)
    with pytest.raises(TrainingError, match=r"bad\.npz: weights: expected temperature, volume, fuel_left, "):
        load_team(tmp_path / "bad.npz")


def test_damaged_files(tmp_path):
    make_ranking().save(tmp_path / "a.npz")
    good = (tmp_path / "a.npz").read_bytes()
    with pytest.raises(TrainingError, match=r"a: expected a team file \(.npz\), got BadZipFile"):
        parse_team(good[: len(good) // 2], source="a")
    n_refused = 0
    for place in range(40, len(good) - 40, 23):
        bad = bytearray(good)
        bad[place] ^= 0x5A
        try:
            read = parse_team(bytes(bad), source="a")
        except TrainingError:
            n_refused += 1
        else:
            assert read.digest == make_ranking().digest, "damaged where nothing is told"
    assert n_refused > 20
