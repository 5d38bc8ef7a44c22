"""Kinds of scenarios: what makes another one, and what does not."""

from __future__ import annotations

import pytest

from fireworld.recording.golden.text import scenario_kind
from fireworld.scenario import load_scenario, parse_scenario

QUICK = load_scenario("quick")


def test_a_kind_is_said_in_words():
    assert scenario_kind(QUICK) == (
        "generated city of 10 x 8 lots, 2 brigades, fire in one place, civilians all around, "
        "choices in-turn, reward stock, parameters paper"
    )


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("city.generated.columns", "11", "generated city of 11 x 8 lots"),
        ("brigades.n", "3", "3 brigades"),
        ("fires.1", "{at: [0.1, 0.1]}", "fire in several places"),
        ("fires.0", "{buildings: [0, 1]}", "fire in one place, by building"),
        ("civilians", "{n: 4, directions: [N, W]}", "civilians on some sides"),
        ("civilians", "{buildings: [5]}", "civilians by building"),
        ("civilians", "{n: 0}", "no civilians"),
        ("choices", "simultaneous", "choices simultaneous"),
        ("reward", "change", "reward change"),
        ("reward", "{burning: -1}", "reward stock with weights"),
        ("reward.of", "change", "reward change with weights"),
        ("preset", "official-2011", "parameters official-2011"),
        ("parameters.brigades.range_m", "10", "parameters paper with changes"),
    ],
)
def test_what_makes_another_kind(key, value, words):
    kind = scenario_kind(QUICK.with_settings({key: value}))
    assert words in kind
    assert kind != scenario_kind(QUICK)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("city.generated.seed", "9"),
        ("fires.0.at", "[0.2, 0.3]"),
        ("fires.0.n_buildings", "7"),
        ("civilians.n", "2"),
        ("civilians.directions", "[W, S, E, N]"),
        ("steps", "7"),
        ("description", "Another one."),
    ],
)
def test_what_does_not(key, value):
    assert scenario_kind(QUICK.with_settings({key: value})) == scenario_kind(QUICK)


def test_a_recorded_scenario_is_of_its_kind():
    """It says every parameter, the preset's too."""
    assert scenario_kind(parse_scenario(QUICK.to_yaml(), source="recorded")) == scenario_kind(QUICK)
