"""Readings of the paper: the file, the design's properties, effects on made-up numbers, a small study end to end."""

from __future__ import annotations

import csv
import itertools
from importlib import import_module
from pathlib import Path
from threading import Event

import numpy as np
import pytest

import fireworld as fw
from fireworld.errors import FireworldError, OutputError, TrainingError
from fireworld.executors import On
from fireworld.executors.packing import Packer
from fireworld.executors.receiving import work
from fireworld.executors.self_test import self_test
from fireworld.interrupt import Interrupted
from fireworld.markdown import escaped
from fireworld.reproduction.readings.choices import SHIPPED, load_choices, read_as
from fireworld.reproduction.readings.design import N_BASIC, design, designed, further, generators
from fireworld.reproduction.readings.effects import (
    Effect,
    main_effects,
    over_readings,
    over_trainings,
    permutation_p,
    student_95,
)
from fireworld.reproduction.readings.findings import findings_text
from fireworld.reproduction.readings.runs import RUNS
from fireworld.reproduction.readings.study import ReadingsSize, ReadingsStudy
from fireworld.reproduction.readings.timing import Timing, longest_first
from fireworld.reproduction.readings.trial import Trial, setting_of
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import load_curriculum
from fireworld.training.methods.sarsa import Sarsa
from fireworld.version import simulator_version
from tests.evaluation.test_reproduce import CURRICULUM, SMALL_PAPER
from tests.executors.test_elsewhere import dask
from tests.real_data import real_file

try_readings_module = import_module("fireworld.reproduction.readings.try_readings")


def test_the_file_has_the_22_choices_and_a_level_that_changes_nothing_is_ours():
    choices = load_choices()
    assert [choice.number for choice in choices] == list(range(1, 23))
    for choice in choices:
        empty = [name for name, level in choice.levels.items() if not any(getattr(level, part) for part in PARTS)]
        assert empty == [choice.ours], choice.name
    ours = read_as(choices, {})
    assert not any(getattr(ours.level, part) for part in PARTS)


def test_the_docs_have_every_choice_and_switch():
    page = (Path(__file__).parents[2] / "docs" / "readings.md").read_text()
    for choice in load_choices():
        (line,) = [line for line in page.splitlines() if line.startswith(f"| {choice.number} | {choice.name} |")]
        assert choice.sentence in line
        for name, level in choice.levels.items():
            assert name in line
            for part in PARTS:
                assert all(
                    f"`{key}: {str(value).lower()}`" in line.replace("True", "true")
                    for key, value in getattr(level, part).items()
                )


PARTS = ("method", "scenario", "training", "study")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("number: 1,", "number: one,", r"choices\[0\].number: expected `int`, got `str`"),
        ("ours: per-scenario", "ours: never", r"choices.epsilon: ours: expected one of the levels .*, got 'never'"),
        ("screen: [fresh, same]", "screen: [same, fresh]", r"choices.randomness: screen: expected fresh and another"),
        ("{fixed_noise: true}", "{fixed_nose: true}", r"choices.randomness: levels.same: --set: fixed_nose: expected"),
        ("{observation.flags: target}", "{observation.flags: no}", r"choices.flags-of-what: levels.target: .*flags"),
        ("name: reward,", "name: epsilon,", r"choices.epsilon: name: expected another name"),
        ("{fires: 1.5}", "{fire: 1.5}", r"choices.first-fires: levels.larger: .*fire"),
    ],
)
def test_faults_are_named(tmp_path, old, new, message):
    path, text = tmp_path / "a.yaml", SHIPPED.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    with pytest.raises(TrainingError, match=message) as caught:
        load_choices(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("n_choices", "n_basic"), [(21, 6), (32, 6), (21, 7), (4, 3)])
def test_the_design_is_balanced_of_resolution_four_and_its_own_foldover(n_choices, n_basic):
    signs = design(n_choices, n_basic)
    assert signs.shape == (2**n_basic, n_choices)
    assert (signs[0] == -1).all(), "the first reading is ours"
    assert (signs.sum(axis=0) == 0).all()
    for a, b in itertools.combinations(range(n_choices), 2):
        assert signs[:, a] @ signs[:, b] == 0
    for a, b, c in itertools.combinations(range(n_choices), 3):
        assert (signs[:, a] * signs[:, b] * signs[:, c]).sum() == 0, "no main effect is an interaction of two"
    rows = {tuple(row) for row in signs.tolist()}
    assert rows == {tuple(-value for value in row) for row in rows}
    assert len(set(generators(n_choices, n_basic))) == n_choices


def test_the_shipped_choices_fit_into_the_design():
    for kind, n_basic in N_BASIC.items():
        varied, signs, readings = designed(load_choices(), kind=kind)
        assert signs.shape == (2**n_basic, len(varied)) == (len(readings), 4 if kind == "quick" else 22)
        assert readings[0].study == read_as(load_choices(), {}).study


def test_every_level_is_tried_in_the_design_or_beside_it():
    choices = load_choices()
    _, _, designed_ones = designed(choices, kind="screen")
    tried = [reading.levels for reading in [*designed_ones, *further(choices)]]
    for choice in choices:
        assert {levels.get(choice.name, choice.ours) for levels in tried} == set(choice.levels)
    assert all(len(reading.levels) == 1 for reading in further(choices)), "all else is ours"


def test_further_levels_are_reported_and_leave_the_effects_as_they_are():
    choices = load_choices()
    varied, signs, readings = designed(choices, kind="quick")
    beside = further(choices)
    draws = np.random.default_rng(3)
    values = [draws.normal(0.1, 0.1, (3, 2)) for _ in range(len(readings) + len(beside))]
    words = {"choices": varied, "signs": signs, "differences": values, "levels": values}
    without = {"readings": readings, **words, "differences": values[:8], "levels": values[:8]}
    found = ReadingsStudy(size=ReadingsSize("screen", 3, 2), readings=[*readings, *beside], **words)
    alone = ReadingsStudy(size=ReadingsSize("screen", 3, 2, further=False), **without)
    assert (found.effects, found.p) == (alone.effects, alone.p)
    (sentence,) = set(findings_text(found)) - set(findings_text(alone))
    assert sentence.startswith(
        f"Further levels, all else ours, where it adds {found.estimates[0].text()}: epsilon not-reset"
    )
    assert all(estimate.text() in sentence for estimate in found.estimates[8:])


def test_effects_of_made_up_readings():
    signs = design(8, 5)
    means = 0.1 + 0.15 * signs[:, 2] - 0.05 * signs[:, 5] + 0.3 * signs[:, 0] * signs[:, 1]
    effects = main_effects([*"abcdefgh"], signs, means)
    assert [round(one.mean, 9) + 0.0 for one in effects] == [0, 0, 0.3, 0, 0, -0.1, 0, 0]
    width = {round(one.high - one.low, 9) for one in effects}
    assert len(width) == 1, "one spread for all: what the main effects leave"
    assert over_readings(signs, means).mean == pytest.approx(0.1)
    assert permutation_p(signs, 0.1 + 0.2 * signs[:, 2]) < 0.001
    noise = np.array([(7 * n * n) % 31 for n in range(32)]) / 31.0
    assert permutation_p(signs, noise) > 0.01


@pytest.mark.parametrize(
    ("freedom", "quantile"), [(1, 12.706), (2, 4.303), (3, 3.182), (6, 2.447), (10, 2.228), (42, 2.018), (1000, 1.962)]
)
def test_quantiles_of_students_t(freedom, quantile):
    assert student_95(freedom) == pytest.approx(quantile, rel=0.002)


@pytest.mark.parametrize("uneven", [False, True])
def test_intervals_of_main_effects_hold_what_is_true_in_95_of_100_studies(uneven):
    """Trainings and seeds of a reading have much in common; with `uneven`, readings scatter more at some levels."""
    draws, n_held, n_mean_held, n_all = np.random.default_rng(7), 0, 0, 0
    signs = design(21, 6)
    for _ in range(400):
        true = draws.normal(0.0, 0.1, 21)
        of_reading = draws.normal(0.0, 0.15, (64, 1, 1)) * (np.exp(0.5 * signs[:, :1, None]) if uneven else 1.0)
        of_training, of_run = draws.normal(0.0, 0.25, (64, 2, 1)), draws.normal(0.0, 0.2, (64, 2, 10))
        values = (signs @ true / 2.0)[:, None, None] + of_reading + of_training + of_run
        means = values.mean(axis=(1, 2))
        effects = main_effects([""] * 21, signs, means)
        mean = over_readings(signs, means)
        n_mean_held += mean.low <= 0.0 <= mean.high
        n_held += sum(one.low <= wanted <= one.high for one, wanted in zip(effects, true, strict=True))
        n_all += 21
    assert 0.94 <= n_held / n_all <= 0.96
    assert 0.92 <= n_mean_held / 400 <= 0.98


@pytest.mark.parametrize("n_trainings", [3, 5])
def test_intervals_of_a_reading_hold_what_is_true_in_95_of_100_studies(n_trainings):
    draws, n = np.random.default_rng(8), 3000
    held = 0
    for _ in range(n):
        values = 0.1 + draws.normal(0.0, 0.25, (n_trainings, 1)) + draws.normal(0.0, 0.2, (n_trainings, 10))
        one = over_trainings(values)
        held += one.low <= 0.1 <= one.high
    assert 0.938 <= held / n <= 0.962


def test_a_mean_of_zero_has_one_sign_and_ends_keep_theirs():
    values = np.array([-0.1, 0.0, 0.0999])[:, np.newaxis]
    assert over_trainings(values).text() == "+0.00 [-0.25, +0.25]"
    one = Effect(-0.07, -0.13, -0.001)
    assert one.text() == "-0.07 [-0.13, -0.00]", "below 0"


@pytest.mark.parametrize("n_trainings", [1, 2])
def test_of_two_trainings_no_interval_can_be_told(n_trainings):
    one = over_trainings(np.full((n_trainings, 10), 0.5))
    assert one.text() == "+0.50 [no interval]"
    assert not one.can_tell
    assert not one.above_zero
    assert not one.below_zero


METHOD = Sarsa(n_episodes_max=3, n_episodes_unchanged=2)


@pytest.fixture
def small(tmp_path, monkeypatch):
    monkeypatch.setattr("fireworld.reproduction.readings.trial.TESTS", SMALL_PAPER)
    monkeypatch.setattr(try_readings_module, "QUICK", ReadingsSize("quick", 1, 2, METHOD, further=False))
    path = tmp_path / "small.yaml"
    path.write_text(CURRICULUM)
    return path


def tables(folder):
    """The bytes of all that a study leaves."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.heavy
def test_a_study_is_resumed_and_comes_out_the_same(small, tmp_path):
    whole = fw.try_readings(tmp_path / "a", quick=True, curriculum=small)
    rows = [*csv.DictReader((tmp_path / "a" / RUNS).read_text().splitlines())]
    assert len(rows) == (8 + 3) * 2
    assert len(whole.study.confirmed) == 3
    assert "Main effects" in whole.report.read_text()
    quoted = (tmp_path / "a" / "readings.md").read_text()
    for effect in (*whole.study.effects, *whole.study.level_effects, *whole.study.control_effects):
        assert escaped(effect.text()) in quoted
    assert all(sentence.endswith(".") for sentence in whole.findings)
    with pytest.raises(OutputError, match="--resume continues it"):
        fw.try_readings(tmp_path / "a", quick=True, curriculum=small)
    fw.try_readings(tmp_path / "b", quick=True, curriculum=small)
    runs = tmp_path / "b" / RUNS
    runs.write_bytes(runs.read_bytes()[: runs.stat().st_size // 2])  # as after a kill
    again = fw.try_readings(tmp_path / "b", quick=True, curriculum=small, resume=True)
    assert tables(tmp_path / "b") == tables(tmp_path / "a")
    assert again.findings == whole.findings
    assert 0 < len(again.study.timing.parts[0]) < 8, "the times of those that were made now"
    with pytest.raises(TrainingError, match="seeds"):
        fw.try_readings(tmp_path / "b", quick=True, seeds=3, curriculum=small, resume=True)
    other = tmp_path / "other.yaml"
    other.write_text(SHIPPED.read_text().replace("epsilon_schedule: compounding", "epsilon_schedule: training"))
    with pytest.raises(
        TrainingError, match=f"{RUNS}: line [0-9]+: expected a reading that is to be tried, got another"
    ):
        fw.try_readings(tmp_path / "b", file=other, quick=True, curriculum=small, resume=True)


@pytest.mark.heavy
def test_a_study_is_continued_with_more_trainings(small, tmp_path):
    """What was tried is not tried again; the trainings that there were are the first of more."""
    words = {"quick": True, "curriculum": small}
    once = fw.try_readings(tmp_path / "a", **words).study
    twice = fw.try_readings(tmp_path / "a", repetitions=2, resume=True, **words).study
    assert len(twice.timing.parts[0]) == 8, "the second trainings alone"
    anew = fw.try_readings(tmp_path / "b", repetitions=2, **words).study
    for first, grown, whole in zip(once.differences, twice.differences, anew.differences, strict=True):
        assert (first == grown[:1]).all()
        assert (grown == whole).all()


OF_TWO = """\
choices:
  - {number: 1, name: a, sentence: s, ours: one, screen: [one, two], levels: {one: {}, two: {method: {alpha: 0.1}}MORE}}
  - {number: 2, name: b, sentence: s, ours: one, screen: [one, two], levels: {one: {}, two: {method: {gamma: 0.1}}}}
"""


@pytest.mark.heavy
def test_a_study_is_continued_with_a_further_level(small, tmp_path, monkeypatch):
    """What was tried is not tried again, whatever its number is now."""
    monkeypatch.setattr(try_readings_module, "QUICK", ReadingsSize("quick", 1, 2, METHOD))
    before, after = tmp_path / "before.yaml", tmp_path / "after.yaml"
    before.write_text(OF_TWO.replace("MORE", ""))
    after.write_text(OF_TWO.replace("MORE", ", three: {method: {alpha: 0.3}}"))
    words = {"quick": True, "curriculum": small}
    fw.try_readings(tmp_path / "a", file=before, **words)
    study = fw.try_readings(tmp_path / "a", file=after, resume=True, **words).study
    assert len(study.timing.parts[0]) == 1, "the further reading alone"
    fw.try_readings(tmp_path / "b", file=after, **words)
    continued, anew = (
        {(row["setting"], row["training"]) for row in csv.DictReader((tmp_path / name / RUNS).read_text().splitlines())}
        for name in ("a", "b")
    )
    assert anew <= continued, "the best of before may have been confirmed as well"


@pytest.mark.heavy
@pytest.mark.parametrize("word", ["processes", dask, "tests.executors.far:make_executor"])
def test_a_study_has_the_same_bytes_whoever_makes_it(word, small, tmp_path):
    fw.try_readings(tmp_path / "here", quick=True, curriculum=small, executor=1)
    found = fw.try_readings(tmp_path / "there", quick=True, curriculum=small, executor=On(word, 2))
    assert tables(tmp_path / "there") == tables(tmp_path / "here")
    assert [len(part) for part in found.study.timing.parts] == [8, 3]


@pytest.mark.heavy
@pytest.mark.parametrize("word", ["threads", "processes"])
def test_a_study_that_is_stopped_keeps_its_trials(word, small, tmp_path):
    stop = Event()

    def after_two(what, n_done, n_all):
        if n_done >= 2:
            stop.set()

    words = {"quick": True, "curriculum": small, "executor": On(word, 1)}
    with pytest.raises(Interrupted, match=r"[2-7] trials are kept in .*: --resume continues"):
        fw.try_readings(tmp_path / "a", on_progress=after_two, stop=stop, **words)
    fw.try_readings(tmp_path / "a", resume=True, **words)
    fw.try_readings(tmp_path / "b", **words)
    assert tables(tmp_path / "a") == tables(tmp_path / "b")


def test_a_curriculum_without_a_stage_alone_is_refused(tmp_path):
    path = tmp_path / "together.yaml"
    path.write_text("stages: [{name: one, cooperation: true, scenarios: [quick]}]")
    with pytest.raises(TrainingError, match=r"stages: expected one without cooperation, got .*one"):
        fw.try_readings(tmp_path / "a", quick=True, curriculum=path)
    assert not (tmp_path / "a").exists()


@pytest.mark.parametrize(("words", "name"), [({"design": "all"}, "design"), ({"seeds": 0}, "seeds")])
def test_arguments_are_checked_first(words, name, tmp_path):
    with pytest.raises(FireworldError, match=f"{name}: expected"):
        fw.try_readings(tmp_path / "a", **words)
    assert not (tmp_path / "a").exists()


def test_times_of_trials():
    timing = Timing(2)
    assert timing.text == ""
    timing.add([6.0, 4.0, 4.0, 2.0], [3.0, 2.0, 2.0, 1.0], 8.8)
    timing.add([2.0], [1.0], 2.2)
    assert timing.total == 18.0
    assert timing.predicted(1) == 9.0
    assert timing.predicted(2) == 4.0 + 1.0
    assert timing.predicted(64) == 3.0 + 1.0, "the parts wait for one another"
    assert (
        "5 trials took 18 s added up (9 s of computing), 9 s for each of 2 workers; all of it took 11 s, 1.22 times"
        in timing.text
    )
    assert longest_first([], 3) == 0.0


KOBE_TOO = "levels: {{dense: {{}}, kobe: {{scenario: {{city.official: {path}}}}},"


def with_map(path, folder):
    """Write a file of readings whose choice `city` has a map as a level; return it."""
    file = folder / "mine.yaml"
    file.write_text(SHIPPED.read_text().replace("levels: {dense: {},", KOBE_TOO.format(path=path)))
    return file


@pytest.mark.heavy
def test_a_map_is_a_level_of_the_city(small, tmp_path):
    """Its folder is relative to the file of readings; it travels with the trials."""
    fw.export_city("quick", tmp_path / "town")
    choices = load_choices(with_map("town", tmp_path))
    (tmp_path / "elsewhere").mkdir()
    fw.export_city("quick", tmp_path / "elsewhere" / "town")
    moved = load_choices(with_map("town", tmp_path / "elsewhere"))
    setting, same, other = (
        setting_of(read_as(found, {"city": level}), load_curriculum(small), METHOD)
        for found, level in ((choices, "kobe"), (moved, "kobe"), (choices, "dense"))
    )
    assert setting.digest == same.digest != other.digest
    scenarios = [*setting.curriculum.scenarios, *setting.tests]
    assert all(scenario.city.official == str(tmp_path / "town") for scenario in scenarios)
    assert len(setting.files) == 1
    trial, packer = Trial(setting, 1, [1000]), Packer()
    shares, packed = trial().shares, packer.pack([trial])
    for file in (tmp_path / "town").iterdir():  # as on another machine
        file.unlink()
    order = {"version": simulator_version(), "digest": self_test(), "modules": (), "apart": packer.apart}
    _, (tried,) = work({**order, "content": packed.content, "needs": packed.needs})
    assert tried.shares == shares


@pytest.mark.heavy
def test_kobe_is_a_level_of_the_city(small, tmp_path):
    choices = load_choices(with_map(real_file("maps/kobe"), tmp_path))
    setting = setting_of(read_as(choices, {"city": "kobe"}), load_curriculum(small), METHOD)
    assert 0.0 <= Trial(setting, 1, [1000])().shares[0][0] <= 1.0
    whole = setting_of(read_as(choices, {"city": "kobe"}), load_curriculum("paper"), METHOD)
    cities = CityCache(whole.files)
    n_buildings = fw.import_city(real_file("maps/kobe")).summary["n_buildings"]
    assert {cities.build(one).city.n_buildings for one in whole.curriculum.scenarios} == {n_buildings}


def test_a_map_that_is_not_there_is_named(tmp_path):
    with pytest.raises(TrainingError, match=r"choices.city: levels.kobe: .*no-map"):
        load_choices(with_map("no-map", tmp_path))


@pytest.mark.heavy
@pytest.mark.parametrize(
    "level",
    [(choice.name, name) for choice in load_choices() for name in choice.levels if name != choice.ours],
    ids="-".join,
)
def test_every_level_can_be_tried(level, small):
    reading = read_as(load_choices(), dict([level]))
    shares = Trial(setting_of(reading, load_curriculum(small), METHOD), 1, [1000])().shares
    assert len(shares) == 1
    assert all(0.0 <= share <= 1.0 for share in shares[0])
