"""Suites: what they are, that nobody learned in them, and that they stay what they are."""

from __future__ import annotations

import json
from itertools import pairwise

import pytest

import fireworld as fw
from benchmarks import suites as made
from fireworld.errors import FireworldError
from fireworld.evaluation.suites import NAMES, digest_of, suite, suite_names, suites
from fireworld.scenario import scenario_names
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import curriculum_names, load_curriculum

DIGESTS = {
    "tests": "9387804893fe",
    "paper-world": "81943b94c1be",
    "contested": "b19781da2485",
    "larger": "20f860d0b570",
    "scarce-water": "f47152b21717",
    "two-sites": "cfb52501dd24",
    "three-sites": "d92f826d47d7",
    "few-brigades": "ee3e3d7869c0",
    "many-brigades": "388c3f39f307",
    "official-like": "373638a6b52d",
}
"""A leaderboard compares rows of months: a suite that has to change gets another name."""


def test_suites_stay_what_they_are():
    assert {one.name: one.digest[:12] for one in suites() if one.name in DIGESTS} == DIGESTS
    assert {*suite_names()} <= {*DIGESTS}
    assert [name for name in NAMES if name in suite_names()] == suite_names()


def city_of(scenario):
    city = scenario.city
    return city.generated.seed if city.generated else city.sha256


def test_nobody_learned_in_their_cities():
    taught = {city_of(one) for name in curriculum_names() for one in load_curriculum(name).scenarios}
    taught |= {city_of(fw.suite("tests").scenarios[0])}
    for one in suites():
        if one.sampled:
            assert taught.isdisjoint(map(city_of, one.scenarios)), one.name


def test_the_suite_and_the_curriculum_of_one_name_share_no_fire():
    """Where one learns `contested` is the curriculum, where one measures the suite: docs/leaderboard.md."""
    learned = {one.digest for one in load_curriculum("contested").scenarios}
    assert learned.isdisjoint(one.digest for one in suite("contested").scenarios)
    assert {*suite_names()} & {*curriculum_names()} == {"contested"}
    assert not {*suite_names()} & {*scenario_names()}


@pytest.mark.slow
def test_no_fire_is_in_two_suites_and_every_one_can_be_built():
    cities, seen = CityCache(), dict[str, str]()
    for one in suites():
        for scenario in one.scenarios:
            assert scenario.digest not in seen, (scenario.name, seen[scenario.digest])
            seen[scenario.digest] = scenario.name
            assert len(cities.build(scenario).placement.ignited) > 0
    assert len({*seen.values()}) == len(seen)


def test_what_the_suites_say_of_themselves():
    for contested, larger in zip(suite("contested").scenarios, suite("larger").scenarios, strict=True):
        assert (contested.fires[0].at, contested.civilians) == (larger.fires[0].at, larger.civilians)
        assert larger.fires[0].n_buildings == round(1.25 * contested.fires[0].n_buildings)
    assert {one.brigades.n for one in suite("few-brigades").scenarios} == {2}
    assert {one.brigades.n for one in suite("many-brigades").scenarios} == {6, 8}
    assert {one.brigades.n for one in suite("official-like").scenarios} == {12, 16}
    for name, n in (("two-sites", 2), ("three-sites", 3)):
        assert {len(one.fires) for one in suite(name).scenarios} == {n}
    scarce = suite("scarce-water").scenarios
    assert sum(one.resolved_parameters.brigades.refuge_refill_litres == 500 for one in scarce) >= 8
    assert sum(len(one.city.generated.refuges) == 1 for one in scarce) == 6
    assert sum(one.preset == "official-2011" for one in scarce) == 6
    assert [one.name for one in scarce] == [f"scarce-water-{k}" for k in range(1, 21)]
    assert [one.name for one in suite("tests").scenarios] == ["test-1", "test-2", "test-3"]
    assert {one.brigades.n for one in suite("paper-world").scenarios} == {4, 7, 8}


def test_a_suite_shows_itself_and_has_a_digest():
    found = fw.suite("larger")
    assert repr(found) == "<Suite larger: 20 scenarios>"
    assert found.digest == digest_of([one.digest for one in found.scenarios])
    assert all(a.digest != b.digest for a, b in pairwise(found.scenarios))
    assert isinstance(found, fw.Suite)
    assert [one.name for one in fw.suites()] == suite_names()


@pytest.mark.parametrize("name", ["largr", "", "test-1", None])
def test_a_name_that_is_none(name):
    with pytest.raises(FireworldError, match=r"^suite: expected one of tests, .*official-like, got ") as caught:
        suite(name)
    if name == "largr":
        assert str(caught.value).endswith("; try larger")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["contested", "two-sites"])
def test_the_first_fire_is_found_again(name):
    """All of them are found again by `python -m benchmarks.suites --check`."""
    text = (made.FOLDER / f"{name}.yaml").read_text()
    city, fire = next(made.fires_of(made.SUITES[name].groups[0]))
    assert made.line(fire, city=city) in text


@pytest.mark.slow
def test_compare_takes_suites_beside_scenarios_and_shows_a_row_for_each():
    words = {"seeds": 2, "set": {"steps": 15}}
    found = fw.compare(["nearest-to-me", "easiest"], scenarios=["three-sites", "quick"], **words)
    one_by_one = fw.compare(["nearest-to-me", "easiest"], scenarios=[*suite("three-sites").scenarios], **words)
    rows = {row["scenario"]: row for row in found.table if row["metric"] == "burnt-out"}
    of_the_suite = next(row for row in one_by_one.table if (row["scenario"], row["metric"]) == (None, "burnt-out"))
    assert rows["three-sites"] == {**of_the_suite, "scenario": "three-sites"}
    assert list(rows) == ["three-sites", "quick", None]
    for side in ("a", "b"):
        middle = (rows["three-sites"][side]["mean"] + rows["quick"][side]["mean"]) / 2
        assert rows[None][side]["mean"] == pytest.approx(middle), "every row counts the same"
    assert rows[None]["difference"]["mean"] == pytest.approx(rows[None]["b"]["mean"] - rows[None]["a"]["mean"])
    assert [each.get("n_scenarios") for each in found.to_dict()["scenarios"]] == [12, None]
    assert f"in {rows[None]['a']['n_truncated']} of 26 runs of A" in found.notes[0]


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ("tests,test-1", "scenarios: expected each scenario once, got test-1 a second time"),
        ("larger,larger", "scenarios: expected each scenario once, got larger-1 a second time"),
        ("largr", "expected the name of a scenario or suite, or a .yaml file, got 'largr'; try larger"),
        ("contested,nowhere", "nowhere"),
    ],
)
def test_mistakes_take_one_line(fireworld, names, message):
    done = fireworld("compare", "chief", "random", "--scenarios", names)
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert message in done.err


@pytest.mark.parametrize("name", ["larger", "two-sites"])
def test_nobody_trains_in_a_suite_by_its_name(fireworld, here, name):
    done = fireworld("train", name, "-o", "team.npz")
    assert (done.code, done.out) == (2, "")
    assert not (here / "team.npz").exists()


def test_a_suite_can_be_checked_scenario_by_scenario(fireworld):
    done = fireworld("scenarios", "check", "three-sites", "--seeds", 1, "--set", "steps=5", "--json")
    assert done.code == 0, done.err
    assert len(json.loads(done.out)["checks"]) == 12
