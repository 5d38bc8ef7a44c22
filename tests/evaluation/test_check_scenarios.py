"""`check_scenarios`: verdicts, hints, tables, and that no water is no water."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from statistics import fmean
from threading import Event

import pytest

import fireworld as fw
from fireworld.arguments import ArgumentError
from fireworld.errors import FireworldError, ScenarioError
from fireworld.evaluation.contested import Limits
from fireworld.evaluation.judge import N_POLICIES
from fireworld.evaluation.runs import evaluate
from fireworld.evaluation.scenario_check import RULES
from fireworld.interrupt import Interrupted
from fireworld.policy.names import BUILT_IN
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario

SEEDS = (3, 8)


@pytest.fixture(scope="module")
def quick():
    (check,) = fw.check_scenarios("quick", seeds=SEEDS).checks
    return check


def other(check, scores, *, no_water=0.0, **keys):
    """Return a check in which the rules, one after another, have these scores."""
    rules = [replace(rule, score_share=score) for rule, score in zip(check.rules, scores, strict=True)]
    scenario = check.scenario.with_values(keys) if keys else check.scenario
    return replace(check, rules=tuple(rules), no_water=replace(check.no_water, score_share=no_water), scenario=scenario)


def test_the_rules_come_out_as_when_each_is_run_alone(quick):
    built = build_scenario(load_scenario("quick"))
    assert [rule.policy for rule in quick.rules] == list(RULES)
    for rule in quick.rules:
        runs = [fw.run("quick", policy=rule.policy, seed=seed).outcome for seed in SEEDS]
        assert rule.score_share == pytest.approx(fmean(run.score_share for run in runs))
        assert rule.n_burnt_out == fmean(run.n_burnt_out for run in runs)
        assert rule.steps == fmean(run.steps for run in runs)
        assert rule.n_ended == sum(run.completed for run in runs)
    assert quick.n_burning == len(built.placement.ignited) == 4
    assert quick.n_buildings == 80
    assert quick.score_share == pytest.approx(fmean(rule.score_share for rule in quick.rules))


@pytest.mark.parametrize("policy", ["easiest", "random"])
def test_without_water_nothing_is_sprayed_and_it_does_not_matter_what_brigades_do(quick, policy):
    run = fw.run("quick", policy=policy, seed=SEEDS[0], set={"parameters.brigades.power_litres": 0})
    assert run.outcome.water_used_litres == 0
    built = build_scenario(load_scenario("quick").with_values({"parameters.brigades.power_litres": 0}))
    found = evaluate(built, BUILT_IN[policy](), SEEDS)
    assert quick.no_water.score_share == pytest.approx(found.score_share.mean())
    assert quick.no_water.n_burnt_out == found.n_burnt_out.mean()


@pytest.mark.parametrize(
    ("score", "verdict"), [(0.0, "lost"), (0.119, "lost"), (0.12, "contested"), (0.6, "contested"), (0.601, "held")]
)
def test_the_limits(score, verdict):
    assert Limits().verdict(score) == verdict


def test_limits_of_ones_own(quick):
    (check,) = fw.check_scenarios("quick", seeds=SEEDS, lost_below=0.85, held_above=0.9).checks
    assert (quick.verdict, check.verdict) == ("held", "lost")
    assert check.rules == quick.rules


@pytest.mark.parametrize(
    ("scores", "no_water", "keys", "verdict", "hint"),
    [
        ([0.9] * 6, 0.3, {}, "held", "try more burning buildings (fires.0.n_buildings), or fewer brigades (brigades.n"),
        ([0.9] * 5 + [0.05], 0.0, {}, "held", "most rules hold it, random does not; try more burning buildings"),
        ([1.0] * 6, 0.95, {}, "held", "without any water the score is 0.95: the fire hardly spreads, or harms nobody;"),
        ([0.3] * 6, 0.25, {}, "contested", "what brigades do makes hardly a difference: do they reach the fire? try"),
        ([0.0] * 5 + [0.5], 0.0, {}, "lost", "try fewer burning buildings (fires.0.n_buildings), or more brigades ("),
        ([0.0] * 5 + [1.0], 0.0, {}, "contested", ""),
        (
            [0.9] * 6, 0.3, {"fires.0": {"buildings": [3]}}, "held",
            "try more buildings named in fires.0.buildings, or fewer brigades (brigades.n below 2)",
        ),
    ],
)  # fmt: skip
def test_hints_say_which_way_to_go(quick, scores, no_water, keys, verdict, hint):
    check = other(quick, scores, no_water=no_water, **keys)
    assert check.verdict == verdict
    assert check.hint.startswith(hint)
    assert bool(hint) == bool(check.hint)
    assert check.brigades_matter == ("difference" not in hint and "without" not in hint)


def test_a_single_building_cannot_be_fewer(quick):
    check = replace(other(quick, [0.0] * 5 + [0.5]), n_burning=1)
    assert check.hint == "try more brigades (brigades.n above 2)"


def test_numbers_of_burning_buildings():
    found = fw.check_scenarios("quick", counts=[6, 2, 4, 2], seeds=SEEDS)
    assert [check.n_burning for check in found.checks] == [2, 4, 6]
    assert found.checks[1].scenario.digest == load_scenario("quick").digest
    shares = [check.score_share for check in found.checks]
    assert shares == sorted(shares, reverse=True)
    text = " ".join(repr(found).split())
    burning = [str(check.n_burning) for check in found.checks if check.verdict == "contested"]
    assert f"quick: contested with {', '.join(burning)} burning buildings" in text
    assert "ended" not in text


@pytest.mark.parametrize(
    ("scores", "sentence"),
    [
        ((0.9, 0.8), "quick: held with 4 burning buildings, too; try more burning buildings"),
        ((0.1, 0.0), "quick: lost with 2 burning buildings already; "),
        ((0.9, 0.0), "quick: held with 2 burning buildings, lost with 4; try the numbers between them"),
    ],
)
def test_if_no_number_is_contested(quick, scores, sentence):
    found = fw.check_scenarios("quick", counts=[2, 4], seeds=SEEDS)
    checks = tuple(other(check, [score] * 6) for check, score in zip(found.checks, scores, strict=True))
    assert sentence in " ".join(repr(replace(found, checks=checks)).split())


def test_a_fire_that_names_its_buildings_has_no_number(tmp_path):
    named = load_scenario("quick").with_values({"fires.0": {"buildings": [3]}, "name": "named"})
    (tmp_path / "named.yaml").write_text(named.to_yaml())
    with pytest.raises(ScenarioError, match=r"fires\.0: expected `at`, around .*; try `fireworld scenarios new -o"):
        fw.check_scenarios(tmp_path / "named.yaml", counts=[3])
    assert fw.check_scenarios(tmp_path / "named.yaml", seeds=1).checks[0].n_burning == 1


def test_fires_of_later_steps_count():
    later = load_scenario("quick").with_values({"fires.1": {"at": [0.1, 0.9], "n_buildings": 2, "step": 5}})
    assert fw.check_scenarios(later, seeds=1).checks[0].n_burning == 6


def test_what_is_shown_fits_80_columns(quick, tmp_path):
    long = tmp_path / "a_folder_with_a_long_name" / "and_a_scenario_with_a_long_name.yaml"
    long.parent.mkdir()
    long.write_text(load_scenario("quick").with_values({"steps": 60}).to_yaml())
    found = fw.check_scenarios(["quick", long], seeds=SEEDS)
    lines = [line for line in repr(found).splitlines() if line != str(long)]
    assert max(map(len, lines)) <= 80
    assert any(line.startswith("...h_a_long_name.yaml") for line in lines)
    assert lines[:2] == ["quick", "4 of 80 buildings burn; 2 brigades, 4 civilians, 100 steps"]
    assert f"held: the rules score {quick.score_share:.2f} on the mean" in lines
    page = found._repr_html_()
    assert page.count("<table>") == 3
    assert "nearest-to-civilian" in page


def test_json_and_markdown(quick):
    found = fw.check_scenarios("quick", seeds=SEEDS)
    values = json.loads(json.dumps(found.to_dict()))
    assert (values["format"], values["seeds"]) == ("fireworld-scenario-check/1", [3, 8])
    assert (values["lost_below"], values["held_above"]) == (0.12, 0.6)
    (check,) = values["checks"]
    assert check["digest"] == load_scenario("quick").digest
    assert [policy["policy"] for policy in check["policies"]] == [*RULES, "no water"]
    assert check["score_share"] == quick.score_share
    head, line, row = found.markdown.splitlines()
    assert head.count("|") == line.count("|") == row.count("|") == 12
    assert row.startswith(f"| `quick` | 4 | {quick.score_share:.2f} | ")
    assert row.endswith("| held |")


def test_results_do_not_depend_on_the_executor(quick):
    seen = []
    with ThreadPoolExecutor(3) as pool:
        for executor in (1, 4, "threads", pool):
            found = fw.check_scenarios("quick", seeds=SEEDS, executor=executor, on_run=lambda *n: seen.append(n))
            assert found.checks[0].rules == quick.rules
    assert seen[: 1 + 2 * N_POLICIES] == [(k, 2 * N_POLICIES) for k in range(1 + 2 * N_POLICIES)]


@pytest.mark.slow
def test_processes_come_to_the_same(quick):
    assert fw.check_scenarios("quick", seeds=SEEDS, executor="processes").checks[0].rules == quick.rules


def test_it_stops_when_asked():
    stop = Event()
    with pytest.raises(Interrupted):
        fw.check_scenarios("quick", executor=1, on_run=lambda n, _: n >= 3 and stop.set(), stop=stop)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"counts": []}, "counts: expected one number of burning buildings or more"),
        ({"counts": [0]}, "counts: expected a whole number from 1 to 100000, got 0"),
        ({"counts": 200}, "n_buildings: expected at most"),
        ({"lost_below": 0.6}, r"lost_below: expected less than held_above \(0.6\), got 0.6"),
        ({"held_above": 2}, "held_above: expected a number from 0 to 1, got 2"),
        ({"lost_below": float("nan")}, "lost_below: expected a number"),
        ({"seeds": 0}, "seeds: expected a whole number from 1"),
        ({"executor": "two"}, "executor: expected"),
        ({"scenarios": ["quick", "quick"]}, "each scenario once"),
        ({"scenarios": "quik"}, "try quick"),
        ({"set": {"brigades.n": 0}}, "brigades.n: expected a whole number from 1"),
    ],
)
def test_mistakes(given, message):
    with pytest.raises(FireworldError, match=message):
        fw.check_scenarios(**{"scenarios": "quick", **given})


def test_limits_are_checked():
    with pytest.raises(ArgumentError):
        Limits(0.5, 0.2)
