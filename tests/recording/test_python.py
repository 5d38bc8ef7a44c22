"""Recordings from Python: the same results as on the command line, objects that show themselves, one-line errors."""

from __future__ import annotations

import json
from concurrent.futures import ProcessPoolExecutor

import pytest
from fireworld_recorder.reader import open_log

import fireworld as fw
from fireworld.arguments import ArgumentError
from fireworld.errors import FireworldError, LogError, OutputError, PolicyError, ViewError
from fireworld.policy.protocol import Action, Decision
from fireworld.recording.difference import diff
from fireworld.recording.explain import explain
from fireworld.recording.export import export, recover
from fireworld.recording.fork import fork, prepare_fork
from fireworld.recording.pages.pictures import render_film, render_picture
from fireworld.recording.pages.run_page import report
from fireworld.recording.pages.view import view
from fireworld.recording.verify import verify

pytestmark = pytest.mark.slow


def test_a_difference_is_what_the_command_writes(here, fireworld):
    difference = diff("easiest.mcap", here / "random.mcap", ignore=["draws"], last_step=20)
    words = ("diff", "easiest.mcap", here / "random.mcap", "--ignore", "draws", "--to", 20)
    done = fireworld(*words, "--json", "--junit", "out.xml", "--html", "out.html")
    assert json.loads(done.out) == json.loads(json.dumps(difference.to_dict()))
    assert difference.junit() == (here / "out.xml").read_bytes()
    assert difference.page() == (here / "out.html").read_text(encoding="utf-8")
    difference.save_html(here / "again.html")
    assert (here / "again.html").read_bytes() == (here / "out.html").read_bytes()
    with pytest.raises(OutputError, match=r"again\.html: expected a name that is free"):
        difference.save_html(here / "again.html")


def test_a_difference_shows_itself(here):
    difference = diff(open_log("easiest.mcap"), "random.mcap")
    lines = repr(difference).splitlines()
    assert lines[0].startswith("changed: policy: random, was easiest")
    assert lines[1] == difference.first.sentence
    score = difference.totals[1].outcome.score
    assert any(line.startswith("score") and line.endswith(f"{score:.6g}") for line in lines)
    html = difference._repr_html_()
    assert difference.first.sentence in html
    assert "How it spread" in html
    assert "<img" not in html


def test_runs_and_differences_play_in_a_notebook(here):
    run, difference = fw.open_log("easiest.mcap"), diff("easiest.mcap", "random.mcap")
    for shown, n_runs in ((run.show(), 1), (difference.show(), 2)):
        html = shown._repr_html_()
        assert html.startswith("<iframe")
        assert "&lt;!doctype html&gt;" in html
        assert shown.html == shown.save(here / "page.html").read_text(encoding="utf-8")
        assert repr(shown).startswith("<PlayedPage ")
        assert repr(shown).count("seed") == n_runs
    assert run.show(-1).png == run.show(60).png
    with pytest.raises(ArgumentError, match="what: expected a step, 'play' or 'rerun', got 'film'"):
        run.show("film")
    with pytest.raises(ArgumentError, match="what: expected a step"):
        difference.show("")


def test_a_missing_widget_takes_a_line(here):
    notebook = pytest.importorskip("rerun.notebook")
    if notebook.HAS_NOTEBOOK:
        pytest.skip("the widget is here")
    with pytest.raises(
        ViewError, match=r"show: Rerun's widget is not installed; try pip install 'rerun-sdk\[notebook\]"
    ):
        fw.open_log("easiest.mcap").show("rerun")


def test_runs_of_one_digest(here):
    difference = diff("easiest.mcap", open_log("easiest.mcap"))
    assert difference.same
    assert difference.first is None
    assert repr(difference) == f"the same: 61 steps, digest {open_log('easiest.mcap').digest}"
    assert difference.to_dict()["n_steps_compared"] == 61
    assert "61 steps are the same" in difference._repr_html_()


@pytest.mark.parametrize(
    ("given", "options", "message"),
    [
        ((3, "easiest.mcap"), {}, "recording: expected the path of a recording, or a run, got 3"),
        (("none.mcap", "easiest.mcap"), {}, "none.mcap: cannot be read"),
        (("easiest.mcap", "random.mcap"), {"first_step": 9, "last_step": 8}, "a range of steps, got 9 to 8"),
        (("easiest.mcap", "random.mcap"), {"ignore": ["building"]}, "ignore: expected a field of the log"),
        (("easiest.mcap", "random.mcap"), {"tolerances": {"hp": -1.0}}, "tolerance: hp: expected a number >= 0"),
        (("easiest.mcap", "other-scenario.mcap"), {}, "cannot compare runs of different scenarios"),
    ],
)
def test_what_cannot_be_compared(here, given, options, message):
    with pytest.raises(LogError, match=message):
        diff(*given, **options)


def test_a_verification(here, fireworld):
    verified = verify("easiest.mcap")
    assert verified
    assert fireworld("verify", "easiest.mcap").out == f"{verified}\n"
    assert json.loads(fireworld("verify", "easiest.mcap", "--json").out) == verified.to_dict()
    with pytest.raises(LogError, match=r"none\.mcap: cannot be read"):
        verify(here / "none.mcap")


@pytest.mark.parametrize("given", ["nearest-to-me", Action.NEAREST_TO_ME, Decision(3)])
def test_a_decision_can_be_given_in_three_ways(here, answer, given):
    """By a step in which the brigade has to decide; the same run as by the command."""
    wanted = answer("fork", "easiest.mcap", "--at", 5, "--decide", "0=nearest-to-me", "--record", "f.mcap")
    prepared = prepare_fork("easiest.mcap", at=5, decide={0: given})
    assert prepared.header.forked_from == wanted["forked_from"]
    records = list(prepared)
    assert records[6].decisions.action[0] == Action.NEAREST_TO_ME
    assert records[-1].score.score == wanted["score"]
    assert list(prepared)[-1].score.score == wanted["score"], "it can be run again"


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"at": 99}, LogError, "at: expected a step of easiest.mcap, 0 to 60, got 99"),
        ({"at": "first"}, LogError, "at: expected a step of easiest.mcap, 0 to 60, got 'first'"),
        ({"at": 5, "decide": {0: 9}}, ArgumentError, "decide: 0: expected a whole number from 0 to 3, got 9"),
        ({"at": 5, "decide": {0: Decision(9)}}, ArgumentError, "decide: 0: expected a whole number from 0 to 4, got 9"),
        ({"at": 5, "decide": {0: Decision(4, target=80)}}, ArgumentError, "decide: 0: target: .* from 0 to 79, got 80"),
        ({"at": 5, "decide": {0: Decision(4, target=-1)}}, ArgumentError, "decide: 0: target: .* from 0 to 79, got -1"),
        ({"at": 5, "decide": {0: Decision(4)}}, ArgumentError, "decide: 0: target: .* from 0 to 79, got None"),
        ({"at": 5, "decide": {"0": "easiest"}}, ArgumentError, "decide: brigade: expected a whole number"),
        ({"at": 5, "decide": {0: "easist"}}, PolicyError, "decide: 0: expected one of .* try easiest"),
        ({"at": 5, "decide": {0: "easiest"}, "swap": {0: "chief.mcap"}}, ArgumentError, "one of them for brigade 0"),
        ({"at": 5, "swap": {0: 7}}, LogError, "expected the path of a recording, or a run, got 7"),
    ],
)
def test_forks_that_cannot_be(here, options, error, message):
    with pytest.raises(error, match=message):
        prepare_fork("easiest.mcap", **options)


def test_a_fork_in_memory_and_recorded(here):
    fork_in_memory = fork("easiest.mcap", at=5, decide={1: "nearest-to-me"}, policy=easiest_for_all)
    recorded = fork("easiest.mcap", at=5, decide={1: "nearest-to-me"}, policy=easiest_for_all, record="f.mcap")
    assert recorded.digest == fork_in_memory.digest == open_log("f.mcap").digest
    assert diff(fork_in_memory, "f.mcap").same
    assert diff("easiest.mcap", fork_in_memory).first.step == 6
    assert verify("f.mcap")
    with pytest.raises(OutputError, match="use --force to replace it"):
        fork("easiest.mcap", at=5, record=here / "f.mcap")
    again = fork("easiest.mcap", at=5, record=here / "f.mcap", force=True)
    assert again.digest == open_log("easiest.mcap").digest


def easiest_for_all(observation):
    """Decide by a function of the observation."""
    return Decision(Action.EASIEST)


def test_swaps_of_open_runs(here, answer):
    other = open_log("own.mcap")
    prepared = prepare_fork(open_log("easiest.mcap"), at=0, swap={0: other, 1: "own.mcap"})
    assert list(prepared)[-1].score.score == other.step(int(other.steps[-1])).score.score


def test_an_explanation_is_what_the_command_writes(here, answer):
    replays = []
    found = explain("random.mcap", open_log("chief.mcap"), budget=6, on_replay=lambda: replays.append(1))
    assert json.loads(json.dumps(found.to_dict())) == answer("explain", "random.mcap", "chief.mcap", "--budget", 6)
    assert len(replays) == found.result.n_replays <= 6
    lines = repr(found).splitlines()
    assert lines[0].endswith(" to explain")
    assert any(str(found.effects[0].span) in line for line in lines)
    assert str(found.effects[0].span) in found._repr_html_()


def test_replays_in_processes_give_the_same(here):
    with ProcessPoolExecutor(1) as pool:
        found = explain("random.mcap", "chief.mcap", budget=4, executor=pool)
    assert found.to_dict() == explain("random.mcap", "chief.mcap", budget=4).to_dict()


@pytest.mark.parametrize(
    ("options", "message"), [({"budget": 1}, "budget: expected a whole number from 2"), ({"executor": 0}, "executor: ")]
)
def test_explanations_that_cannot_be(here, options, message):
    with pytest.raises(FireworldError, match=message):
        explain("random.mcap", "chief.mcap", **options)


def test_equal_scores_are_shown_too(here):
    found = explain("easiest.mcap", "easiest.mcap")
    assert repr(found).endswith("there is no difference to explain")
    assert "there is no difference to explain" in found._repr_html_()


def test_export_and_recover(here):
    assert export("easiest.mcap", here / "tables", tables=["steps"]) == {"steps": 61}
    with pytest.raises(LogError, match=r"table: expected one of .*; try steps"):
        export("easiest.mcap", here / "more", tables=["step"])
    assert not (here / "more").exists()
    (here / "cut.mcap").write_bytes((here / "easiest.mcap").read_bytes()[:-5000])
    recovery = recover("cut.mcap", "good.mcap")
    assert recovery.damage
    assert open_log("good.mcap").steps.tolist() == list(range(recovery.n_steps))
    assert diff("easiest.mcap", "cut.mcap", partial=True).same


def test_pages_and_pictures_of_runs_that_are_open(here):
    log = open_log("easiest.mcap")
    report(log, here / "page.html")
    assert "easiest, seed 1" in (here / "page.html").read_text(encoding="utf-8")
    render_picture([log, "random.mcap"], here / "two.png", steps=[0, -1])
    frames = []
    steps = render_film([log], here / "film.gif", last_step=4, every=3, on_frame=lambda *done: frames.append(done))
    assert steps == [0, 3, 4]
    assert frames == [(1, 3), (2, 3), (3, 3)]
    view([log], save=here / "run.rrd", last_step=3)
    assert {path.suffix for path in here.iterdir()} >= {".html", ".png", ".gif", ".rrd"}


@pytest.mark.parametrize("logs", [[], ["easiest.mcap"] * 3, [4], 4])
def test_one_or_two_runs_are_shown(here, logs):
    for make in (
        lambda: view(logs, save="run.rrd"),
        lambda: render_picture(logs, "run.png"),
        lambda: report(logs, "run.html"),
    ):
        with pytest.raises(LogError, match=r"expected (one or two|the path of a recording)"):
            make()
    assert not list(here.glob("run.*"))
