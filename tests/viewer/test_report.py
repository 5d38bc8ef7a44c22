"""`fireworld report`: what the page says, that it needs nothing else, and that its commands repeat the run."""

from __future__ import annotations

import re
import shlex
import sys
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from fireworld_recorder.reader import open_log
from fireworld_viewer.pictures.curves import draw_curves, draw_timeline
from fireworld_viewer.pictures.figure_files import PAIR_COLORS
from fireworld_viewer.story.series import OwnTarget, count_choices

from fireworld.cli import root
from fireworld.records import ACTION_NAMES, MemoryRecording
from tests.viewer.conftest import make_recording
from tests.viewer.recorded import write_log

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def _in_a_folder(here):
    """Every page is made in a folder of its own."""


@pytest.fixture
def recordings(tmp_path, small, slower):
    """a.mcap and b.mcap in one city."""
    write_log(tmp_path / "a.mcap", small)
    write_log(tmp_path / "b.mcap", slower)


@pytest.fixture(scope="module")
def page_of_a(tmp_path_factory, small):
    """The page of a.mcap, called page.html, in a folder with a.mcap."""
    folder = tmp_path_factory.mktemp("page")
    write_log(folder / "a.mcap", small)
    done = CliRunner().invoke(root, ["report", str(folder / "a.mcap"), "-o", str(folder / "page.html")])
    assert (done.exit_code, done.output) == (0, f"wrote {folder / 'page.html'}; open it in a browser\n")
    return folder / "page.html"


def text_of(path: Path) -> str:
    """What a reader sees of a page, without pictures and marks."""
    return unescape(re.sub(r"<[^>]*>", " ", path.read_text(encoding="utf-8").split("</head>")[1]))


def with_decisions(recording: MemoryRecording, **columns: list[list[int]]) -> MemoryRecording:
    """Replace fields of the decisions of steps 1, 2, ...; later steps are left out."""
    n = len(next(iter(columns.values())))
    records = list(recording)[: n + 1]
    for index in range(n):
        chosen = {name: np.array(rows[index], "i4") for name, rows in columns.items()}
        records[index + 1] = replace(records[index + 1], decisions=replace(records[index + 1].decisions, **chosen))
    return MemoryRecording(recording.header, recording.city, records)


def test_what_brigades_chose_is_counted(small):
    own = ACTION_NAMES.index("own-target")
    recording = with_decisions(
        small,
        action=[[3, own, -1], [3, own, -1], [0, own, 1], [-1, own, 1], [3, -1, 1]],
        target=[[5, 9, -1], [5, 9, -1], [6, 8, 4], [-1, 9, 4], [5, -1, 4]],
        explored=[[1, 0, 0], [0, 0, 0], [1, 0, 0], [0, 0, 0], [0, 0, 0]],
    )
    first, second, third = count_choices(recording)
    assert first.n_by_action == (1, 0, 0, 3, 0)
    assert (first.n_without, first.n_changes, first.n_explored) == (1, 2, 2)
    assert (second.n_by_action[own], second.n_without, second.n_changes) == (4, 1, 2)
    assert second.own_targets == [
        OwnTarget(building=9, n_steps=3, first_step=1, last_step=4),
        OwnTarget(building=8, n_steps=1, first_step=3, last_step=3),
    ]
    assert (third.n_without, third.own_targets) == (2, [])
    steps = list(recording)[1:]
    assert first.sprayed_litres == sum(int(step.brigades.sprayed_litres[0]) for step in steps)
    assert sum(first.n_by_action) + first.n_without == len(steps), "the start is no step"


def test_refills_are_counted(small):
    records = list(small)
    kinds, who = np.array([6, 6, 5, 6], "u1"), np.array([0, 2, 1, 2], "i4")
    records[3] = replace(records[3], events=replace(records[3].events, kind=kinds, entity=who))
    assert [one.n_refills for one in count_choices(MemoryRecording(small.header, small.city, records))] == [1, 0, 2]


def test_the_timeline_has_a_band_for_each_stretch(small):
    recording = with_decisions(small, action=[[3, 0, -1], [3, 1, -1], [-1, 1, -1]])
    (axes,) = draw_timeline([recording]).axes
    bars = [path.get_extents() for item in axes.collections for path in item.get_paths()]
    chosen = sorted((box.y0 + 0.38, box.x0, box.x1) for box in bars if box.height > 0.4)
    assert [(round(lane), start, end) for lane, start, end in chosen] == [(0, 0.5, 2.5), (1, 0.5, 1.5), (1, 1.5, 3.5)]


def test_curves_of_two_runs_lie_over_each_other(small, slower):
    figure = draw_curves([small, slower])
    for axes in figure.axes:
        low, high = axes.get_ylim()
        lines = [line for line in axes.get_lines() if line.get_linestyle() != ":"]
        assert [line.get_color() for line in lines] == [*PAIR_COLORS]
        assert lines[0].get_linestyle() == "-" != lines[1].get_linestyle()
        for line, run in zip(lines, (small, slower), strict=True):
            assert len(line.get_xdata()) == len(run.steps)
            assert low <= min(line.get_ydata())
            assert max(line.get_ydata()) <= high


def test_the_score_of_a_good_run_is_no_flat_line(small):
    records = [replace(one, score=replace(one.score, score=6.9 - 0.001 * one.step)) for one in small]
    axes = draw_curves([MemoryRecording(small.header, small.city, records)]).axes[0]
    low, high = axes.get_ylim()
    assert low < 6.9 - 0.04
    assert high > 7.0
    assert high - low < 0.2
    flat = [replace(one, score=replace(one.score, score=7.0)) for one in small]
    low, high = draw_curves([MemoryRecording(small.header, small.city, flat)]).axes[0].get_ylim()
    assert low < 7.0 < high


def test_counts_have_ticks_at_whole_numbers(small, slower):
    few = [replace(one, score=replace(one.score, n_burnt_out=one.step % 2)) for one in small]
    run = MemoryRecording(small.header, small.city, few)
    for recordings in ([run], [run, run]):
        for axes in draw_curves(recordings).axes:
            if axes.get_title(loc="left").startswith("buildings"):
                assert all(float(tick).is_integer() for tick in axes.get_yticks())


def test_a_page_of_one_run(page_of_a, small):
    page = page_of_a.read_text(encoding="utf-8")
    assert page.count('src="data:image/png;base64,') == 3
    assert re.findall(r'(?:src|href)="(?!data:)', page) == []
    assert "http" not in re.sub(r"base64,[^\"]*|srcdoc=\"[^\"]*\"", "", page)
    assert page.count("<iframe") == 1
    text, last = text_of(page_of_a), list(small)[-1].score
    assert f"{last.score:.3f} of {last.score_max:.0f}" in text
    assert f"{last.n_burnt_out} of 36 buildings" in text
    assert open_log(page_of_a.with_name("a.mcap")).digest in text
    for title in ("Outcome", "Maps", "Curves", "Decisions", "Events", "How to get the same again"):
        assert f"<h2>{title}</h2>" in page


def test_a_page_of_two_runs_marks_where_they_differ(fireworld, recordings, tmp_path):
    assert fireworld("report", "a.mcap", "b.mcap", "-o", "ab.html").code == 0
    page = (tmp_path / "ab.html").read_text(encoding="utf-8")
    assert "<td><b>easiest</b></td><td><b>nearest-to-me</b></td>" in page
    assert '<td class="text">seed</td><td>3</td><td>3</td>' in page
    assert "B: b.mcap" in page


def test_the_same_bytes_each_time_and_wherever_the_recording_lies(fireworld, recordings, page_of_a, tmp_path):
    assert fireworld("report", "a.mcap", "-o", "again.html").code == 0
    assert (tmp_path / "again.html").read_bytes() == page_of_a.read_bytes()


def test_a_cut_off_recording_says_so_and_its_names_are_no_marks_of_the_page(fireworld, tmp_path, small):
    header = replace(small.header, scenario="<script>alert(1)</script>", policy="a\nb&c")
    write_log(tmp_path / "cut.mcap", MemoryRecording(header, small.city, list(small)[:12]), last=9)
    done = fireworld("report", "cut.mcap", "-o", "cut.html")
    assert done.code == 0
    assert done.err.endswith("; reporting 10 committed steps\n")
    page = (tmp_path / "cut.html").read_text(encoding="utf-8")
    assert '<p class="caveat">cut.mcap: ' in page
    assert "<script>" not in page
    assert "&lt;script&gt;" in page
    assert "a\\nb&amp;c" in page


def test_the_commands_of_a_page_repeat_the_run(fireworld, tmp_path):
    asked = ("run", "quick", "--policy", "random", "--seed", "7", "--steps", "25", "--set", "brigades.n=3")
    assert fireworld(*asked, "--record", "run.mcap").code == 0
    assert fireworld("report", "run.mcap", "-o", "run.html").code == 0
    page = (tmp_path / "run.html").read_text(encoding="utf-8")
    commands = [
        line.split("   #")[0] for line in unescape(re.findall(r"<pre>(.*?)</pre>", page, re.DOTALL)[0]).split("\n")
    ]
    (scenario,) = re.findall(r"<summary>scenario.yaml</summary><pre>(.*?)</pre>", page, re.DOTALL)
    (tmp_path / "scenario.yaml").write_text(unescape(scenario), encoding="utf-8")
    for command in commands:
        done = fireworld(*shlex.split(command)[1:])
        assert done.code == 0, done.err
    assert commands[1].startswith("fireworld run scenario.yaml --policy random --seed 7 --steps 25")
    assert open_log("again.mcap").digest == open_log("run.mcap").digest


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("a.mcap", "-o", "a.txt"), "a.txt: expected a file ending in .html, .htm, got '.txt'"),
        (("a.mcap", "-o", "none/a.html"), "none/a.html: expected an existing folder none, got 'none'; make it first"),
        (("absent.mcap", "-o", "a.html"), "absent.mcap: cannot be read"),
        (("a.mcap", "b.mcap", "a.mcap", "-o", "a.html"), "Expected one or two recordings, got 3"),
        (("a.mcap", "other.mcap", "-o", "a.html"), "recordings: expected two of one city"),
        (
            ("start.mcap", "-o", "mine.html"),
            "mine.html: expected a name that is free, got an existing file; use --force to replace it",
        ),
    ],
    ids=lambda words: " ".join(words) if isinstance(words, tuple) else "",
)
def test_mistakes_take_one_line(fireworld, recordings, tmp_path, words, message):
    write_log(tmp_path / "other.mcap", make_recording(5, 5, 3))
    (tmp_path / "mine.html").write_text("mine")
    before = sorted(path.name for path in tmp_path.iterdir())
    done = fireworld("report", *words)
    assert (done.code, done.out) == (2, "")
    assert message in done.err
    assert sorted(path.name for path in tmp_path.iterdir()) == before
    assert (tmp_path / "mine.html").read_text() == "mine"


def test_a_recording_of_the_start_alone(fireworld, tmp_path, small):
    """Nobody was asked yet, nothing happened: the page still says what there is."""
    write_log(tmp_path / "start.mcap", MemoryRecording(small.header, small.city, list(small)[:1]))
    assert fireworld("report", "start.mcap", "-o", "start.html").code == 0
    assert "Nothing happened." in text_of(tmp_path / "start.html")


def test_a_missing_library_is_named(fireworld, recordings, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = fireworld("report", "a.mcap", "-o", "a.html")
    assert done.code == 2
    assert "matplotlib is not installed; try pip install 'fireworld[figures]'" in done.err
    assert not (tmp_path / "a.html").exists()
