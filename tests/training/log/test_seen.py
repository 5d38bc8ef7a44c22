"""Trainings in Rerun, as pictures and as pages."""

import re
import shlex
import shutil

import numpy as np
import pytest

from fireworld.errors import LogError, OutputError
from fireworld.policy.teams.table_team import agreement
from fireworld.training.log.course import course_of
from fireworld.training.log.pages.page import _by_scenario, _panels, _training_command, render_training, report_training
from fireworld.training.log.pages.view import states_page, view_trainings
from fireworld.training.log.reader import open_training
from fireworld.training.train import prepare_trainings
from fireworld.training.training import train_all
from tests.training.log.conftest import SHORT
from tests.viewer import rrd

pytest.importorskip("matplotlib")


def test_the_curves_are_those_of_the_log(log):
    course = course_of(log)
    returns = [line.total_reward for line in log.lines]
    assert course.plots["return"][""].tolist() == returns
    assert course.plots["epsilon"][""].tolist() == [line.epsilon for line in log.lines]
    for number in (0, 7, len(log) - 1):
        errors = np.abs(log.episode_at(number).td_error)
        errors = errors[~np.isnan(errors)]
        levels = [course.plots["td_error"][f"{share} %"][number] for share in (10, 50, 90)]
        assert levels == pytest.approx(np.quantile(errors, [0.1, 0.5, 0.9]))
        assert course.plots["n_visited"][""][number] == log.lines[number].n_visited
    last = log.trainer_before(len(log)).progress
    same, common = agreement(last.tables, last.visits)
    assert course.plots["agreement"][""][-1] == (same / common if common else pytest.approx(np.nan, nan_ok=True))
    assert [mark.part for mark in course.marks] == [k for k, line in enumerate(log.lines) if line.ended]


def test_what_is_seen_live_is_what_is_seen_of_the_log(curriculum, log):
    seen = []

    def note(training, report):
        seen.append(training.trainer.points(report))

    (training,) = prepare_trainings(curriculum, set=SHORT)
    training.trainer.watched = True
    train_all([training], callbacks=[note])
    assert training.team.digest == log.team().digest
    assert seen == [trainer.points(report) for trainer, report in log.reports()]


def test_the_picture_of_the_tables(log):
    picture = course_of(log).tables
    last = log.trainer_before(len(log)).progress
    for row, state in enumerate(picture.states.tolist()):
        for table in range(3):
            seen = last.visits[table, state].any() or last.tables[table, state].any()
            assert picture.action[row, table, -1] == (last.tables[table, state].argmax() if seen else -1)
    assert list(picture.visits) == sorted(picture.visits, reverse=True)
    page = states_page(picture)
    assert page.count("\n| ") == len(picture.states) + 1


@pytest.mark.slow
def test_pages_and_pictures(log_path, make_log, tmp_path, fireworld):
    other = make_log(alpha=0.6)
    done = fireworld("report", log_path, "-o", tmp_path / "a.html")
    assert done.code == 0
    report_training([log_path, other], tmp_path / "two.html")
    report_training(log_path, tmp_path / "again.html")
    page = (tmp_path / "a.html").read_text()
    assert page == (tmp_path / "again.html").read_text()
    assert "Convergence" in page
    assert f"fireworld replay {log_path.name} --scenario together-2 --episode" in page
    assert not re.search(r"(src|href)=\"http", page)
    assert "Bold: where they differ" in (tmp_path / "two.html").read_text()
    for ending in (".png", ".svg"):
        assert fireworld("render", log_path, other, "-o", tmp_path / f"a{ending}").code == 0
    report_training(make_log("search"), tmp_path / "search.html")
    assert "Tables of" not in (tmp_path / "search.html").read_text()


def test_convergence_is_drawn_scenario_by_scenario_of_both(log_path, make_log):
    logs = [open_training(log_path), open_training(make_log(alpha=0.6))]
    names = ["a", "b"]
    courses = [course_of(one) for one in logs]
    panels = _by_scenario(courses, names, "return", 1.0)
    assert [panel.title for panel in panels] == [one.name for one in logs[0].scenarios]
    for number, panel in enumerate(panels):
        for one, name in zip(logs, names, strict=True):
            lines = [line for line in one.lines if line.scenario == number]
            assert panel.curves[name][0].tolist() == [line.total_reward for line in lines]
            assert panel.marks.get(name) == (len(lines) - 1 if lines[-1].converged else None)
    assert any(panel.marks for panel in panels)


def test_weights_of_two_searches_are_told_apart(make_log):
    paths = [make_log("search"), make_log("search", seed=2)]
    panels = _panels([course_of(open_training(one)) for one in paths], ["a", "b"])
    weights = [panel for panel in panels if panel.by_curve]
    assert [panel.title for panel in weights] == [
        f"Weights of the {what}; dashed: b" for what in ("building", "brigade", "team")
    ]
    for name, path in zip("ab", paths, strict=True):
        means = open_training(path).team().weights[0]
        assert [values[-1] for panel in weights for values in panel.curves[name].values()] == means[means != 0].tolist()
    assert len(panels) == len(weights) + 2


def test_what_cannot_be_shown(log_path, make_log, tmp_path, fireworld):
    with pytest.raises(LogError, match=r"method: expected paper, as in .*, got 'search'"):
        render_training([log_path, make_log("search")], tmp_path / "a.png")
    with pytest.raises(OutputError, match=r"expected a file ending in \.png"):
        render_training(log_path, tmp_path / "a.gif")
    assert fireworld("run", "quick", "--steps", 2, "--record", tmp_path / "run.mcap").code == 0
    for command in ("view", "report", "render"):
        output = ["--save", tmp_path / "x.rrd"] if command == "view" else ["-o", tmp_path / "x.html"]
        if command == "render":
            output = ["-o", tmp_path / "x.png"]
        done = fireworld(command, log_path, tmp_path / "run.mcap", *output)
        assert (done.code, "expected the log of a training, as the other one" in done.err) == (2, True)
    assert fireworld("render", log_path, "-o", tmp_path / "b.png", "--step", 3).code == 2
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]


def test_a_log_under_way_is_shown_as_far_as_it_is_good(log_path, tmp_path, fireworld):
    data = log_path.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    done = fireworld("report", tmp_path / "cut.mcap", "-o", tmp_path / "cut.html")
    assert done.code == 0
    assert "partial: the file ends" in done.err
    assert "the page ends there" in (tmp_path / "cut.html").read_text()


def words(rows):
    return [(number, row.as_py()[0]) for number, row in rows]


def test_in_rerun(log, tmp_path):
    pytest.importorskip("rerun")
    log.view(save=tmp_path / "a.rrd")
    seen = rrd.read_all(tmp_path / "a.rrd")
    course = course_of(log)
    for plot in ("return", "score", "epsilon", "n_changed", "n_visited"):
        assert words(seen[f"/{plot}"]["Scalars:scalars"]) == [*enumerate(course.plots[plot][""])], plot
    for share in (10, 50, 90):
        drawn = words(seen[rf"/td_error/{share}\ \%"]["Scalars:scalars"])
        assert drawn == [(k, one) for k, one in enumerate(course.plots["td_error"][f"{share} %"]) if not np.isnan(one)]
    ends = [mark.part for mark in course.marks]
    marked = {number for one in ("settled", r"not\ settled") for number, _ in seen[f"/return/{one}"]["Scalars:scalars"]}
    assert marked == set(ends)
    notes = words(seen["/log"]["TextLog:text"])
    assert notes == [(mark.part, f"{mark.text}; {mark.command}") for mark in course.marks]
    begins = [0, *(number + 1 for number in ends[:-1])]
    assert words(seen["/bands/Scenario"]["StateChange:state"]) == [*zip(begins, course.scenarios, strict=True)]
    assert [number for number, _ in seen["/tables/0/now"]["LineStrips2D:strips"]][-len(log.wholes) :] == log.wholes


def test_two_in_rerun(log_path, make_log, tmp_path):
    pytest.importorskip("rerun")
    other = make_log(alpha=0.6)
    view_trainings([log_path, other], save=tmp_path / "ab.rrd")
    seen = rrd.read_all(tmp_path / "ab.rrd")
    for k, path in enumerate((log_path, other)):
        returns = [line.total_reward for line in open_training(path).lines]
        assert [value for _, value in words(seen[f"/return/{path.name}"]["Scalars:scalars"])] == returns
        assert f"/tables/{k}/picture" in seen
    notes = [note for _, note in words(seen["/log"]["TextLog:text"])]
    assert {note.partition(": ")[0] for note in notes} == {log_path.name, other.name}


def test_searches_in_rerun(make_log, tmp_path):
    pytest.importorskip("rerun")
    paths = [make_log("search"), make_log("search", spread=0.5)]
    view_trainings(paths, save=tmp_path / "s.rrd")
    seen = rrd.read_all(tmp_path / "s.rrd")
    for k, path in enumerate(paths):
        drawn = {one for one in seen if one.startswith(f"/own/{k}/weights/")}
        means = open_training(path).team().weights[0]
        assert sorted(words(seen[one]["Scalars:scalars"])[-1][1] for one in drawn) == sorted(means[means != 0])
        assert len(seen[f"/page/{k}"]["TextDocument:text"]) == 3


def test_names_of_files_that_need_care(log_path, tmp_path, fireworld):
    pytest.importorskip("rerun")
    odd = tmp_path / r"_my run $(\a)$ <i>, ä.mcap"
    shutil.copy(log_path, odd)
    render_training([log_path, odd], tmp_path / "ab.svg")
    assert r"_my run $(\a)$ &lt;i&gt;, ä.mcap" in (tmp_path / "ab.svg").read_text()
    report_training(odd, tmp_path / "a.html")
    assert "<i>" not in (tmp_path / "a.html").read_text()
    view_trainings([log_path, odd], save=tmp_path / "ab.rrd")
    log = open_training(odd)
    command = shlex.split(course_of(log).marks[0].command)
    assert command[:3] == ["fireworld", "replay", odd.name]
    command[command.index(odd.name)], command[-1] = odd, tmp_path / command[-1]
    assert fireworld(*command[1:]).code == 0
    assert fireworld("verify", command[-1]).code == 0


def test_a_training_is_had_again_from_its_log_alone(log, log_path, here):
    shutil.copy(log_path, here / "a.mcap")
    command = shlex.split(_training_command(open_training(here / "a.mcap")), comments=True)
    assert command[:2] == ["python", "-c"]
    exec(command[2], {})  # noqa: S102 - a command of our own
    assert open_training(here / "again.mcap").digest == log.digest


@pytest.mark.parametrize("words", [("quick",), ("paper", "--stages", "together")])
def test_a_training_in_what_comes_with_fireworld_is_had_again(words, here, fireworld):
    settings = ("--set", "n_episodes_max=1", "--set", "rule=q-learning", "--set", "shared_table=true", "--seed", 3)
    assert fireworld("train", *words, *settings, "-o", "a.npz", "--record", "a.mcap").code == 0
    log = open_training("a.mcap")
    command = shlex.split(_training_command(log))
    assert command[:2] == ["fireworld", "train"]
    assert command[2 : 2 + len(words)] == [*words]
    assert fireworld(*command[1:]).code == 0
    assert open_training("again.mcap").digest == log.digest


def test_in_notebooks(log):
    assert log.show().png.startswith(b"\x89PNG")
    assert "episodes" in log._repr_html_()
