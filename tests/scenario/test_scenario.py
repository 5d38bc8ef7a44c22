"""Scenarios: what is read, what is refused and how it is told, digests, settings, the shipped ones."""

import json
import math
from pathlib import Path

import msgspec
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from msgspec import inspect

from fireworld.errors import ScenarioError
from fireworld.parameters import OFFICIAL_2011, PAPER
from fireworld.scenario import Scenario, load_scenario, parse_scenario, scenario_names, split_settings
from fireworld.scenario.document import BOUNDS, Document, resolve_reward, with_kind
from fireworld.scenario.explain import find_faults
from tests.docs.scenario_reference import PAGE, renew

TEXT = """\
description: A fire.
city: {generated: {columns: 6, rows: 5}}
fires: [{at: [0.5, 0.5], n_buildings: 3}]
civilians: {n: 2, from_m: 10, to_m: 60}
"""


def parse(text=TEXT, **changes):
    """Read TEXT with some top-level keys replaced."""
    return parse_scenario(yaml.safe_dump(yaml.safe_load(text) | changes), source="my.yaml")


def error_of(call):
    with pytest.raises(ScenarioError) as caught:
        call()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_defaults():
    scenario = parse()
    assert (scenario.preset, scenario.steps, scenario.reward, scenario.brigades.n) == ("paper", 500, "stock", 4)
    assert scenario.resolved_parameters == PAPER
    assert parse(preset="official-2011").resolved_parameters == OFFICIAL_2011


def test_overrides_replace_the_presets_values():
    overrides = {"brigades": {"power_litres": 700}, "fire": {"burn_rate_mean": 0.2}, "health": {"initial_hp": 50}}
    parameters = parse(parameters=overrides).resolved_parameters
    assert parameters.brigades.power_litres == 700
    assert parameters.fire.burn_rate_mean == 0.2
    assert parameters.health.initial_hp == 50
    assert parameters.brigades.tank_litres == PAPER.brigades.tank_litres


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"steps": "seven"}, "steps: expected a whole number from 1 to 100000, got 'seven'"),
        ({"steps": 0}, "steps: expected a whole number from 1 to 100000, got 0"),
        ({"steps": 2.5}, "steps: expected a whole number from 1 to 100000, got 2.5"),
        ({"steps": True}, "steps: expected a whole number from 1 to 100000, got True"),
        ({"steps": None}, "steps: expected a whole number from 1 to 100000, got no value"),
        ({"steps": [1, 2]}, "steps: expected a whole number from 1 to 100000, got the list [1, 2]"),
        ({"description": 7}, "description: expected text, got 7"),
        ({"preset": "official-2014"}, "got 'official-2014'; try official-2013"),
        ({"reward": "flow"}, "reward: expected one of change, stock, got 'flow'"),
        ({"reward": "stok"}, "reward: expected one of change, stock, got 'stok'; try stock"),
        ({"reward": 7}, "reward: expected one of change, stock, or keys and values, got 7"),
        ({"reward": None}, "reward: expected one of change, stock, or keys and values, got no value"),
        (
            {"reward": {"burnt": 1}},
            "reward.burnt: expected one of the keys water_damaged, burning, burnt_out, civilians, ",
        ),
        ({"reward": {"burnt": 1}}, "got 'burnt'; try burnt_out"),
        (
            {"reward": {"burning": math.inf}},
            "reward.burning: expected a number from -1000000000 to 1000000000, got '.inf'",
        ),
        (
            {"reward": {"burning": math.nan}},
            "reward.burning: expected a number from -1000000000 to 1000000000, got '.nan'",
        ),
        ({"reward": {"burning": True}}, "reward.burning: expected a number from -1000000000 to 1000000000, got True"),
        ({"reward": {"burning": 1, "of": "changes"}}, "reward.of: expected one of change, stock, got 'changes'; try"),
        (
            {"reward": {}},
            "reward: expected a weight other than 0 for one of water_damaged, burning, burnt_out, civilians",
        ),
        ({"reward": {"burning": 0, "of": "change"}}, "reward: expected a weight other than 0 for one of water_damaged"),
        ({"brigade": {"n": 3}}, "brigade: expected a known key, got 'brigade'; try brigades"),
        (
            {"brigades": {"count": 3}},
            "brigades.count: expected one of the keys n, at, allocation, targets, got 'count'",
        ),
        ({"brigades": 3}, "brigades: expected keys and values, got 3"),
        ({"brigades": {"n": -1}}, "brigades.n: expected a whole number from 1 to 1000, got -1"),
        ({"parameters": {"brigades": {"power_liters": 1}}}, "got 'power_liters'; try power_litres"),
        (
            {"parameters": {"fire": {"air_heat_kept": 2}}},
            "air_heat_kept: expected a number from 0 to 1, or null, got 2",
        ),
        ({"parameters": {"health": {"slight_probability": 0.9}}}, "parameters.health: expected slight, serious and"),
        ({"city": {}}, "city: expected exactly one of `generated`, `file` and `official`, got none of them"),
        ({"city": {"generated": {"columns": 4}}}, "city.generated.rows: expected a whole number from 1 to 10000, got"),
        ({"city": {"generated": {"columns": 1000, "rows": 1000}}}, "city.generated: expected at most 500000 lots"),
        ({"city": {"generated": {"columns": 2, "rows": 2}, "sha256": "a" * 64}}, "city.sha256: expected null without"),
        ({"fires": []}, "fires: expected a list of 1 or more, each keys and values, got the list []"),
        ({"fires": [{}]}, "fires.0: expected exactly one of `at` and `buildings`, got none of them"),
        (
            {"fires": [{"at": [0.5, 0.5], "buildings": [1]}]},
            "fires.0: expected exactly one of `at` and `buildings`, got",
        ),
        ({"fires": [{"at": [0.5, 1.5]}]}, "fires.0.at.1: expected a number from 0 to 1, got 1.5"),
        ({"fires": [{"at": [0.5]}]}, "fires.0.at: expected a list of 2, each a number from 0 to 1, or null, got the"),
        ({"fires": [{"buildings": [1, 2, 1]}]}, "fires.0.buildings: expected each entry once, got 1 a second time"),
        ({"fires": [{"buildings": [1], "n_buildings": 2}]}, "fires.0.n_buildings: expected null without `at`, got 2"),
        ({"civilians": {}}, "civilians: expected exactly one of `n`, `buildings` and `at`, got none of them"),
        ({"civilians": {"n": 1, "from_m": 9, "to_m": 3}}, "civilians.to_m: expected at least from_m (9.0), got 3.0"),
        ({"civilians": {"n": 1, "directions": ["NE"]}}, "civilians.directions.0: expected one of E, N, S, W, got 'NE'"),
        ({"civilians": {"n": 1, "directions": ["N", "N"]}}, "civilians.directions: expected each entry once, got N a"),
        ({"unit_volume_m3": 0}, "unit_volume_m3: expected a number above 0 and at most 1000000000, or null, got 0"),
    ],
)
def test_an_error_names_file_key_expected_and_found(changes, message):
    text = error_of(lambda: parse(**changes))
    assert text.startswith("my.yaml: ")
    assert message in text


@pytest.mark.parametrize("text", ["", "7", "[1]", "just words", "null"])
def test_a_file_that_holds_no_scenario(text):
    assert error_of(lambda: parse_scenario(text, source="my.yaml")).startswith("my.yaml: expected a scenario")


def test_missing_keys_are_named():
    assert error_of(lambda: parse_scenario("steps: 3", source="my.yaml")) == (
        "my.yaml: city: expected keys and values, got no value"
    )


@given(
    path=st.sampled_from(
        [
            ("steps",),
            ("reward",),
            ("reward", "burning"),
            ("city", "generated", "columns"),
            ("fires", 0, "at"),
            ("civilians", "to_m"),
            (),
        ]
    ),
    value=st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.just([])
    | st.just({"x": 1}),
)
def test_every_document_that_msgspec_refuses_is_explained(path, value):
    document = yaml.safe_load(TEXT)
    if path[:1] == ("reward",):
        document["reward"] = {}
    if path:
        at = document
        for key in path[:-1]:
            at = at[key]
        at[path[-1]] = value
    else:
        document = value
    faults = list(find_faults(document, inspect.type_info(Document)))
    try:
        msgspec.convert(document, Document)
    except msgspec.ValidationError:
        assert faults
    else:
        assert not faults


def test_bounds_are_of_parameters_that_exist():
    names = {name for section in (PAPER.fire, PAPER.health, PAPER.brigades) for name in vars(section)}
    assert set(BOUNDS) <= names


def test_digest_covers_content_but_not_names():
    scenario = parse()
    assert parse(name="other", description="Other words.").digest == scenario.digest
    assert parse(preset="official-2013").digest != scenario.digest
    assert parse(steps=499).digest != scenario.digest
    same_values = {"brigades": {"tank_litres": PAPER.brigades.tank_litres}}
    assert parse(parameters=same_values).digest == scenario.digest


def test_the_allocation_of_brigades_counts_where_it_is_free():
    scenario, free = parse(), parse(brigades={"allocation": "free"})
    assert parse(brigades={"allocation": "fixed"}).digest == scenario.digest
    assert "allocation" not in scenario.to_yaml()
    assert free.digest != scenario.digest
    assert parse_scenario(free.to_yaml(), source="again").digest == free.digest
    assert free.with_settings({"brigades.allocation": "fixed"}).digest == scenario.digest
    with pytest.raises(ScenarioError, match=r"brigades\.allocation: expected one of fixed, free, got 'loose'"):
        scenario.with_settings({"brigades.allocation": "loose"})


def test_digest_is_stable():
    # A digest is recorded in logs: a change here makes every older log's scenario look different.
    assert parse().digest == "82bf77046b5216c30665f1b9037c11b1f0dd6e11bab110322d00ec1a17bd13fa"


@pytest.mark.parametrize("name", scenario_names())
def test_a_resolved_scenario_read_again_is_the_same(name):
    scenario = load_scenario(name)
    again = parse_scenario(scenario.to_yaml(), source="scenario.yaml")
    assert again.digest == scenario.digest
    assert again.resolved == scenario.resolved
    assert again.name == name
    assert "null" not in scenario.to_yaml()


def test_settings():
    scenario = parse()
    assert scenario.with_settings({"brigades.n": "7"}).brigades.n == 7
    assert scenario.with_settings({"fires.0.n_buildings": "2"}).fires[0].n_buildings == 2
    assert scenario.with_settings({"fires.1.buildings": "[4]"}).fires[1].buildings == (4,)
    assert scenario.with_settings({"parameters.brigades.range_m": "30"}).resolved_parameters.brigades.range_m == 30
    assert scenario.with_settings({"description": "no"}).description == "no"
    assert scenario.with_settings({}) == scenario
    changed = parse(parameters={"brigades": {"range_m": 9}}).with_settings({"preset": "official-2011"})
    assert (changed.resolved_parameters.brigades.range_m, changed.resolved_parameters.brigades.tank_litres) == (9, 7500)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (
            "brigades.n",
            "x",
            "my.yaml with --set brigades.n=x: brigades.n: expected a whole number from 1 to 1000, got 'x'",
        ),
        (
            "brigade.n",
            "7",
            "my.yaml with --set brigade.n=7: brigade: expected a known key, got 'brigade'; try brigades",
        ),
        ("fires.7.at", "[0, 0]", "--set fires.7.at: fires.7: expected a number from 0 to 1, got '7'"),
        ("fires.x.at", "[0, 0]", "--set fires.x.at: fires.x: expected a number from 0 to 1, got 'x'"),
        ("steps.n", "7", "--set steps.n: steps.n: expected a key of a scenario, got a part of a plain value"),
        ("steps", "[1", "--set steps: line 1, column 3: expected YAML"),
        ("source", "x", "my.yaml with --set source=x: source: expected a known key, got 'source'"),
    ],
)
def test_wrong_settings(key, value, message):
    assert error_of(lambda: parse().with_settings({key: value})).startswith(message)


def test_rewards():
    """Terms left out count 0; the paper's weights are -1, -2, -3 and 1."""
    rewards = [
        ("stock", (0, (-1.0, -2.0, -3.0, 1.0))),
        ("change", (1, (-1.0, -2.0, -3.0, 1.0))),
        ({"burning": -1, "civilians": 0.01}, (0, (0.0, -1.0, 0.0, 0.01))),
        ({"burnt_out": -5, "of": "change"}, (1, (0.0, 0.0, -5.0, 0.0))),
    ]
    for reward, expected in rewards:
        scenario = parse(reward=reward)
        assert resolve_reward(scenario) == expected
        again = parse_scenario(scenario.to_yaml(), source="again")
        assert (again.reward, again.digest) == (scenario.reward, scenario.digest)
    assert len({parse(reward=reward).digest for reward, _ in rewards}) == len(rewards)


@pytest.mark.parametrize("weight", [math.inf, -math.inf, math.nan, 2e9])
def test_weights_are_finite(weight):
    values = yaml.safe_load(TEXT) | {"reward": {"burning": weight}}
    assert "reward.burning: expected a number from" in error_of(lambda: Scenario.from_dict(values))


def test_a_reward_of_another_kind_keeps_its_weights():
    assert resolve_reward(with_kind(parse(), "change")) == resolve_reward(parse(reward="change"))
    weighted = with_kind(parse(reward={"burning": -4, "of": "change"}), "stock")
    assert resolve_reward(weighted) == (0, (0.0, -4.0, 0.0, 0.0))


def test_setting_one_weight_leaves_the_others():
    def reward(scenario, key, text):
        return resolve_reward(scenario.with_settings({key: text}))

    assert reward(parse(), "reward", "change") == resolve_reward(parse(reward="change"))
    assert reward(parse(), "reward.burning", "-1") == (0, (-1.0, -1.0, -3.0, 1.0))
    assert reward(parse(reward="change"), "reward.burning", "-1") == (1, (-1.0, -1.0, -3.0, 1.0))
    assert reward(parse(reward={"burnt_out": -1}), "reward.burning", "-2.5") == (0, (0.0, -2.5, -1.0, 0.0))
    assert reward(parse(), "reward", "{burning: -1}") == (0, (0.0, -1.0, 0.0, 0.0))
    assert resolve_reward(parse().with_values({"reward.of": "change"})) == (1, (-1.0, -2.0, -3.0, 1.0))


def test_split_settings():
    assert split_settings(["a.b=1", "c=x=y", "d="]) == {"a.b": "1", "c": "x=y", "d": ""}
    assert error_of(lambda: split_settings(["a.b"])) == "--set: expected KEY=VALUE, got 'a.b'; try brigades.n=7"
    assert error_of(lambda: split_settings(["a=1", "a=2"])) == "--set: a: expected each key once, got a a second time"


def test_a_city_file_counts_by_its_content(tmp_path):
    text = "city: {file: town.json}\nfires: [{buildings: [1]}]\n"
    (tmp_path / "one.yaml").write_text(text)
    assert error_of(lambda: load_scenario(tmp_path / "one.yaml")).startswith(
        f"{tmp_path / 'one.yaml'}: city.file: expected a city file, got"
    )
    (tmp_path / "town.json").write_text("{}")
    one = load_scenario(tmp_path / "one.yaml")
    assert one.city.file == str(tmp_path / "town.json")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "two.yaml").write_text(text.replace("town", "../town"))
    assert load_scenario(tmp_path / "sub" / "two.yaml").digest == one.digest
    assert str(tmp_path) not in one.to_yaml()
    assert parse_scenario(one.to_yaml(), source="scenario.yaml").digest == one.digest
    (tmp_path / "town.json").write_text("{ }")
    assert load_scenario(tmp_path / "one.yaml").digest != one.digest


def test_unreadable_files(tmp_path):
    assert error_of(lambda: load_scenario("trian-1")).endswith("got 'trian-1'; try train-1")
    assert error_of(lambda: load_scenario("nothing")).endswith("got 'nothing'; try `fireworld scenarios`")
    missing = tmp_path / "missing.yaml"
    assert error_of(lambda: load_scenario(missing)) == (
        f"{missing}: expected a scenario file, got No such file or directory"
    )
    assert error_of(lambda: load_scenario(tmp_path)).endswith("got Is a directory")
    assert "a scenario file" in error_of(lambda: load_scenario("a\0.yaml"))
    (tmp_path / "big.yaml").write_bytes(b"#" * 1_000_001)
    assert "at most 1000000 bytes" in error_of(lambda: load_scenario(tmp_path / "big.yaml"))


TABLE_1 = {
    "train-1": (5, 9, 4),
    "train-2": (8, 9, 4),
    "train-3": (8, 10, 4),
    "train-4": (8, 8, 4),
    "train-5": (9, 9, 4),
    "train-6": (14, 9, 4),
    "train-7": (20, 9, 4),
    "train-8": (6, 11, 4),
    "test-1": (9, 11, 4),
    "test-2": (10, 11, 4),
    "test-3": (11, 9, 4),
    "test-1-brigades-7": (9, 11, 7),
    "test-2-brigades-8": (10, 11, 8),
    "test-3-brigades-8": (11, 9, 8),
}
"""Burning buildings, civilians, brigades."""
LIKE_THE_PAPERS = {
    name.replace("train-", "paper-train-").replace("test-", "paper-"): (2 * n_burning, n_civilians, n_brigades)
    for name, (n_burning, n_civilians, n_brigades) in TABLE_1.items()
}
"""The same in a world like the paper's."""


@pytest.mark.parametrize("name", TABLE_1)
def test_the_papers_scenarios(name):
    scenario = load_scenario(name)
    assert (scenario.fires[0].n_buildings, scenario.civilians.n, scenario.brigades.n) == TABLE_1[name]
    assert (scenario.preset, scenario.steps, scenario.reward) == ("paper", 500, "stock")
    assert scenario.resolved_parameters == PAPER
    generated = scenario.city.generated
    assert generated is not None
    assert (generated.columns, generated.rows, generated.lot_m, generated.block) == (24, 26, 14.0, (3, 2))


@pytest.mark.parametrize("name", LIKE_THE_PAPERS)
def test_scenarios_in_a_world_like_the_papers(name):
    scenario = load_scenario(name)
    found = scenario.fires[0].n_buildings, scenario.civilians.n, scenario.brigades.n
    assert found == LIKE_THE_PAPERS[name]
    generated = scenario.city.generated
    assert (generated.street_m, generated.fill, generated.seed) == (16.0, (0.6, 0.85), 167)
    assert (scenario.civilians.from_m, scenario.civilians.to_m) == (90, 220)


def test_the_shipped_scenarios_are_complete_and_described():
    assert set(scenario_names()) == {*TABLE_1, *LIKE_THE_PAPERS, "default", "quick"}
    for name in scenario_names():
        description = load_scenario(name).description
        assert 10 < len(description) < 90
        assert description.endswith(".")


def test_more_brigades_change_nothing_else():
    for name, brigades in (("test-1", 7), ("test-2", 8), ("test-3", 8)):
        more = load_scenario(f"{name}-brigades-{brigades}")
        assert load_scenario(name).with_settings({"brigades.n": str(brigades)}).digest == more.digest


def test_the_docs_list_every_key_as_it_is():
    page = PAGE.read_text(encoding="utf-8")
    assert renew(page) == page, "run `make docs`"


def test_the_docs_example_is_train_1():
    page = Path(PAGE).read_text(encoding="utf-8")
    example = page.split("```yaml\n")[1].split("```")[0]
    assert parse_scenario(example, source="docs").digest == load_scenario("train-1").digest


def test_resolved_content_is_plain_json():
    resolved = load_scenario("default").resolved
    assert json.loads(json.dumps(resolved)) == resolved


def test_the_same_scenario_from_yaml_values_and_keywords(tmp_path):
    values = {"city": {"generated": {"columns": 6, "rows": 4}}, "fires": [{"at": [0.5, 0.5]}], "steps": 9}
    made = [Scenario(**values), Scenario.from_dict(values), Scenario.from_yaml(json.dumps(values), folder=tmp_path)]
    assert len({scenario.digest for scenario in made}) == 1
    assert made[0].steps == 9
    with pytest.raises(ScenarioError, match=r"^Scenario: steps: expected a whole number from 1 to 100000, got 0$"):
        Scenario(**{**values, "steps": 0})
