"""Curricula: the paper's, one's own, and every mistake in one line."""

from __future__ import annotations

import pytest

from benchmarks.conditions import CONDITIONS
from fireworld.errors import FireworldError, ScenarioError, TrainingError
from fireworld.evaluation.suites import suites
from fireworld.training.curriculum import curriculum_names, load_curriculum


def test_the_papers_curriculum():
    paper = load_curriculum("paper")
    assert [(stage.name, stage.cooperation, len(stage.scenarios)) for stage in paper.stages] == [
        ("alone", False, 24),
        ("together", True, 8),
    ]
    assert paper.n_scenarios == 32
    alone, together = paper.stages
    assert {scenario.brigades.n for scenario in alone.scenarios} == {1}
    assert [scenario.name for scenario in together.scenarios] == [f"train-{k}" for k in range(1, 9)]
    assert len({scenario.digest for scenario in alone.scenarios}) == 24
    sizes = [scenario.fires[0].n_buildings for scenario in alone.scenarios]
    assert sizes == [1] * 8 + [3] * 8 + [6] * 8, "from easy to hard: what is named first changes last"
    assert "paper" in curriculum_names()


def test_some_of_its_stages():
    paper = load_curriculum("paper")
    assert [stage.name for stage in paper.only(["alone"]).stages] == ["alone"]
    assert paper.only(["together", "alone"]) == paper, "in the order of the curriculum"
    assert paper.only(["alone"]).digest != paper.digest
    with pytest.raises(TrainingError, match=r"^--stages: expected stages of paper: alone, together, got 'toghether'$"):
        paper.only(["alone", "toghether"])


def test_other_values_in_all_scenarios():
    conditions = load_curriculum("conditions").only(["two-sites", "official-like"])
    free = conditions.with_values({"brigades.allocation": "free"})
    assert [stage.name for stage in free.stages] == [stage.name for stage in conditions.stages]
    assert free.n_scenarios == conditions.n_scenarios
    assert {scenario.brigades.allocation for scenario in free.scenarios} == {"free"}
    assert free.digest != conditions.digest
    assert free.with_values({"brigades.allocation": "fixed"}).digest == conditions.digest
    with pytest.raises(ScenarioError, match=r"brigades\.alocation"):
        conditions.with_values({"brigades.alocation": "free"})


def test_the_digest_is_of_what_is_learned(here, curriculum):
    text = (here / "tiny.yaml").read_text()
    (here / "named.yaml").write_text(text.replace("name: alone", "name: lonely"))
    (here / "other.yaml").write_text(text.replace("steps: 12", "steps: 13"))
    assert load_curriculum("named.yaml").digest == curriculum.digest != load_curriculum("other.yaml").digest


def test_scenario_files_are_found_beside_the_curriculum(here, monkeypatch):
    folder = here / "mine"
    folder.mkdir()
    (folder / "fire.yaml").write_text("city: {generated: {columns: 4, rows: 4, seed: 1}}\nfires: [{at: [0.5, 0.5]}]\n")
    (folder / "all.yaml").write_text("stages: [{name: a, cooperation: true, scenarios: [fire.yaml, quick]}]")
    (stage,) = load_curriculum("mine/all.yaml").stages
    assert [scenario.name for scenario in stage.scenarios] == ["fire", "quick"]


@pytest.fixture
def stage_of(here):
    """Write a stage of variations of `quick` and return the scenarios."""

    def build(words):
        (here / "varied.yaml").write_text(f"stages: [{{name: a, cooperation: true, base: quick, {words}}}]")
        (stage,) = load_curriculum("varied.yaml").stages
        return stage.scenarios

    return build


def test_each_group_of_values_is_a_scenario(stage_of):
    scenarios = stage_of("set: {steps: 30}, each: [{brigades.n: 3, civilians.n: 2}, {brigades.n: 5}, {steps: 9}]")
    told = [(one.name, one.steps, one.brigades.n, one.civilians.n) for one in scenarios]
    assert told == [("a-1", 30, 3, 2), ("a-2", 30, 5, 4), ("a-3", 9, 2, 4)], "a group goes before `set`"


def test_each_group_with_every_combination(stage_of):
    scenarios = stage_of(
        "each: [{brigades.n: 3}, {brigades.n: 5, steps: 1}], vary: {steps: [7, 8], civilians.n: [1, 2]}"
    )
    told = [(one.brigades.n, one.steps, one.civilians.n) for one in scenarios]
    assert told == [(n, *rest) for n in (3, 5) for rest in ((7, 1), (7, 2), (8, 1), (8, 2))]
    assert [one.name for one in scenarios] == [f"a-{k}" for k in range(1, 9)]


@pytest.mark.parametrize("words", ["each: []", "each: [{}]", "set: {steps: 100}"])
def test_nothing_to_vary_is_one_scenario(stage_of, words):
    (one,) = stage_of(words)
    assert (one.name, one.steps, one.brigades.n) == ("a-1", 100, 2)


def test_what_is_learned_in_is_not_what_is_tested_in():
    cities = []
    for name in ("contested", "unseen"):
        scenarios = [scenario for stage in load_curriculum(name).stages for scenario in stage.scenarios]
        assert len({scenario.digest for scenario in scenarios}) == len(scenarios), "no fire is there twice"
        cities.append({scenario.city.generated.seed for scenario in scenarios})
    assert not cities[0] & cities[1]
    assert all(len(some) >= 5 for some in cities)


def test_every_condition_has_fires_in_cities_of_its_own():
    curriculum = load_curriculum("conditions")
    assert [stage.name for stage in curriculum.stages] == [*CONDITIONS]
    assert len({scenario.digest for scenario in curriculum.scenarios}) == curriculum.n_scenarios
    others = [one for name in curriculum_names() if name != "conditions" for one in load_curriculum(name).scenarios]
    others += [scenario for one in suites() for scenario in one.scenarios]
    seeds = {one.city.generated.seed for one in others if one.city.generated}
    for stage in curriculum.stages:
        assert 20 <= len(stage.scenarios) <= 40
        assert stage.cooperation
        assert seeds.isdisjoint(one.city.generated.seed for one in stage.scenarios)
    found = {stage.name: stage.scenarios for stage in curriculum.stages}
    n_brigades = {name: {one.brigades.n for one in some} for name, some in found.items()}
    special = {"few-brigades": {2, 3}, "many-brigades": {6, 8}, "official-like": {12, 16}}
    assert n_brigades == {name: special.get(name, {4}) for name in found}
    n_sites = {name: {len(one.fires) for one in some} for name, some in found.items()}
    assert n_sites == {name: {{"two-sites": 2, "three-sites": 3}.get(name, 1)} for name in found}
    assert {one.resolved_parameters.brigades.refuge_refill_litres for one in found["little-refill"]} == {500}
    assert {len(one.city.generated.refuges) for one in found["one-refuge"]} == {1}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "^bad.yaml: expected a curriculum file or one of .*paper.*, got "),
        ("", "bad.yaml: expected `object`, got `null`"),
        ("stages: [", "^bad.yaml: "),
        ("stages: []", r"bad.yaml: stages: expected `array` of length >= 1"),
        ("stages: [{name: a}]", r"^bad.yaml: stages\[0\]: object missing required field `cooperation`$"),
        ("stages: [{name: a, cooperation: true, scenaros: []}]", "contains unknown field `scenaros`"),
        ("stages: [{name: a, cooperation: true}]", "stages.0: expected either `scenarios` or `base`, got 'neither'"),
        ("stages: [{name: a, cooperation: true, base: quick, scenarios: [quick]}]", "got 'both'"),
        ("stages: [{name: a, cooperation: true, scenarios: [qick]}]", "stages.0: scenario: .*got 'qick'; try quick"),
        ("stages: [{name: a, cooperation: true, scenarios: [qick.yaml]}]", "stages.0: qick.yaml: expected a scenario"),
        (
            "stages: [{name: a, cooperation: true, scenarios: [quick], set: {steps: 3}}]",
            "stages.0: expected `set`, `vary` and `each` with `base`, got them with `scenarios`",
        ),
        ("stages: [{name: a, cooperation: true, scenarios: [quick], each: [{steps: 3}]}]", "`each` with `base`"),
        ("stages: [{name: a, cooperation: true, base: quick, each: {steps: 3}}]", "each: expected `array`, got `obj"),
        ("stages: [{name: a, cooperation: true, base: quick, each: [3]}]", r"each\[0\]: expected `object`, got `int`"),
        ("stages: [{name: a, cooperation: true, base: quick, each: [{stepps: 3}]}]", "stages.0: quick .*stepps"),
        ("stages: [{name: a, cooperation: true, base: quick, each: [{steps: 3}, {steps: 0}]}]", "whole number"),
        (
            f"stages: [{{name: a, cooperation: true, base: quick, vary: {{steps: {[1] * 101}}}, each: {[{}] * 100}}}]",
            "vary: expected at most 10000 combinations",
        ),
        ("stages: [{name: a, cooperation: true, base: quick, set: {stepps: 3}}]", "stepps"),
        ("stages: [{name: a, cooperation: true, base: quick, vary: {steps: []}}]", "length >= 1"),
        ("stages: [{name: a, cooperation: true, base: quick, vary: {steps: [0]}}]", "steps: expected a whole number"),
        (
            f"stages: [{{name: a, cooperation: true, base: quick, vary: {{steps: {[1] * 200}, seed: {[1] * 200}}}}}]",
            "vary: expected at most 10000 combinations",
        ),
        (
            "stages: [{name: a, cooperation: true, scenarios: [quick]}, {name: a, cooperation: true, base: quick}]",
            "stages.1: name: expected another name for every stage, got 'a'",
        ),
        (
            "stages: [{name: a, cooperation: true, scenarios: [quick]}, {name: b, cooperation: false, base: quick}]",
            "stages.1: cooperation: expected true, as in the stage before",
        ),
        ("#" * 1_000_001, "a curriculum of at most 1000000 bytes"),
    ],
)
def test_what_is_wrong_with_a_curriculum(here, text, message):
    if text is not None:
        (here / "bad.yaml").write_text(text)
    with pytest.raises(FireworldError, match=message) as caught:
        load_curriculum("bad.yaml")
    assert "\n" not in str(caught.value)
