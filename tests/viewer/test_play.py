"""`fireworld play`: what is in the page, how large it is, and that it needs nothing else."""

from __future__ import annotations

import base64
import hashlib
import re
import shutil
import subprocess
import time
from dataclasses import replace
from html import unescape
from importlib.resources import files

import numpy as np
import pytest
from fireworld_viewer.play.columns import Columns
from fireworld_viewer.play.page import SCRIPTS, FirstDifference, frame, play_page, program
from fireworld_viewer.play.run_columns import ENTITY_FIELDS
from fireworld_viewer.story.narration import decision_lines, event_lines
from fireworld_viewer.story.series import choices_of, series

import fireworld as fw
from fireworld.errors import ViewError
from fireworld.records import MemoryRecording, Recording
from tests.viewer.conftest import make_recording
from tests.viewer.recorded import write_log
from tests.viewer.unpacked import Unpacked, unpacked

NODE = shutil.which("node")


def page_of(*recordings: Recording, **more) -> str:
    return play_page(recordings, names=[f"{letter}.mcap" for letter in "ab"][: len(recordings)], **more)


def test_columns_keep_the_digits_that_are_shown():
    columns = Columns()
    falling = np.array([[5.04, -3.0], [4.96, 1e6], [np.nan, -0.04], [0.0, 7.25]])
    columns.add("falling", falling, digits=1)
    columns.add("whole", np.array([3, 300, -70000], "i4"))
    columns.add("wide", np.arange(3e6).reshape(3, -1))  # in blocks
    columns.add("none", np.zeros((4, 0)))
    columns.add("huge", np.array([1e300, -np.inf]), digits=3)
    found = Unpacked({"columns": columns.table}, b"".join(columns.parts))
    assert found.column("falling")[:2].tolist() == [[5.0, -3.0], [5.0, 1e6]]
    assert np.isnan(found.column("falling")[2, 0])
    assert found.column("whole").ravel().tolist() == [3, 300, -70000]
    assert (found.column("wide") == np.arange(3e6).reshape(3, -1)).all()
    assert found.column("none").shape == (4, 0)
    assert found.column("huge")[0, 0] > 1e10, "what no page can show is cut off, not wrapped"
    assert np.isnan(found.column("huge")[1, 0])


@pytest.mark.parametrize("name", ENTITY_FIELDS)
def test_every_value_of_the_log_is_in_the_page(small, name):
    numbers = series(small, name)
    found = unpacked(page_of(small))
    if not numbers.shape[1]:
        assert f"0.{name}" not in found.words["columns"]
        return
    assert np.abs(found.column(f"0.{name}") - numbers).max() <= 0.5 * 10.0 ** -ENTITY_FIELDS[name] + 1e-9


def test_words_are_those_of_the_narration(small):
    found = unpacked(page_of(small))
    run = found.words["runs"][0]
    asked = np.ones((len(small.steps), len(small.city.brigade_tank_litres)), bool)
    asked[0] = False  # nobody is asked before the first step
    lines = [line.text.split(": ", 1)[1] for line in decision_lines(small, choices_of(small), asked)]
    words = found.column("0.decisions.words").astype(int)
    assert [run["words"][word] for word in words[1:].ravel()] == lines
    assert {run["words"][word] for word in words[0]} == {""}
    assert run["events"] == [line.text for line in event_lines(small)]
    assert found.column("0.events.row").size == len(run["events"])


def test_of_two_runs_the_steps_and_rows_are_aligned(small, slower):
    found = unpacked(page_of(small, slower, first=FirstDifference(step=2, sentence="it differs")))
    assert found.column("both.steps").ravel().tolist() == list(range(41))
    assert found.column("both.rowB").ravel().tolist() == [*range(31), *[30] * 10]
    assert found.words["first"] == {"step": 2, "sentence": "it differs"}


def test_a_page_names_no_other_place_and_runs_no_other_program(small):
    page = page_of(small)
    assert re.findall(r"(?:src|href)=\"(?!#)", page) == []
    assert "http" not in page.replace("http-equiv", "")
    assert "import " not in program()
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    assert policy.startswith("default-src 'none';")
    for tag, kind in (("style", "style-src"), ('script type="module"', "script-src")):
        (text,) = re.findall(rf"<{tag}>(.*?)</{tag.split()[0]}>", page, re.DOTALL)
        assert f"{kind} 'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'" in policy


def test_names_are_no_marks_of_the_page(small):
    evil = "</script><script>alert(1)</script><b>{{script}}"
    recording = MemoryRecording(replace(small.header, scenario=evil, policy=evil), small.city, list(small))
    page = play_page([recording], names=[evil])
    assert "alert(1)" not in page.split("</title>")[1]
    assert page.count("<script") == 2
    assert unpacked(page).words["runs"][0]["scenario"] == evil


def test_what_a_log_lacks_is_left_out(small):
    header = replace(small.header, not_recorded="decisions, rewards, seed, buildings.fuel_share, brigades.activity")
    found = unpacked(page_of(MemoryRecording(header, small.city, list(small))))
    assert found.words["runs"][0]["words"] is None
    assert found.words["runs"][0]["seed"] is None
    lacking = ("0.buildings.fuel_share", "0.brigades.activity", "0.curve.rewards.total", "0.decisions.words")
    assert not {*lacking} & found.words["columns"].keys()


def test_a_frame_holds_the_page(small):
    page = page_of(small)
    held = frame(page, height=500, label='one "run"')
    (inside,) = re.findall(r'srcdoc="([^"]*)"', held)
    assert unescape(inside) == page
    assert "height:500px" in held


@pytest.mark.skipif(NODE is None, reason="no node here")
@pytest.mark.parametrize("name", [*SCRIPTS, "program"])
def test_the_program_is_one(tmp_path, name):
    """Each part by itself, and all of them as the page has them: two of one name would be an error."""
    source = program() if name == "program" else (files("fireworld_viewer.play") / f"{name}.js").read_text()
    (tmp_path / "part.mjs").write_text(source, encoding="utf-8")
    done = subprocess.run([NODE, "--check", tmp_path / "part.mjs"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_parts_use_only_parts_before_them():
    for k, name in enumerate(SCRIPTS):
        text = (files("fireworld_viewer.play") / f"{name}.js").read_text(encoding="utf-8")
        used = set(re.findall(r'^import .* from "\./(\w+)\.js";$', text, re.MULTILINE))
        assert used <= {*SCRIPTS[:k]}, name


@pytest.mark.slow
def test_the_size_that_is_promised(big):
    begin = time.process_time()
    page = page_of(big)
    assert len(page) < 2_000_000
    assert time.process_time() - begin < 10
    hundred = make_recording(26, 24, 100, n_brigades=4, n_civilians=10)  # 624 buildings
    assert len(page_of(hundred)) < 400_000


def test_the_command_writes_what_the_function_writes(fireworld, here, small, slower):
    write_log(here / "a.mcap", small)
    write_log(here / "b.mcap", slower)
    done = fireworld("play", "a.mcap", "b.mcap", "-o", "ab.html")
    assert (done.code, done.err) == (0, "")
    assert re.fullmatch(r"wrote ab\.html, \d+ kB; open it in a browser\n", done.out)
    assert fw.play("a.mcap", fw.open_log("b.mcap"), output="again.html").name == "again.html"
    assert (here / "again.html").read_bytes() == (here / "ab.html").read_bytes()
    first = unpacked((here / "ab.html").read_text(encoding="utf-8")).words["first"]
    assert first["sentence"] in fireworld("diff", "a.mcap", "b.mcap").out.splitlines()


def test_the_same_bytes_wherever_the_recording_lies(fireworld, here, small):
    (here / "below").mkdir()
    for name in ("a.mcap", "below/a.mcap"):
        write_log(here / name, small)
        assert fireworld("play", name, "-o", f"{name}.html").code == 0
    assert (here / "a.mcap.html").read_bytes() == (here / "below" / "a.mcap.html").read_bytes()


def test_a_part_of_the_steps(fireworld, here, small):
    write_log(here / "a.mcap", small)
    assert fireworld("play", "a.mcap", "-o", "a.html", "--from", 10, "--to", 20, "--every", 5).code == 0
    assert unpacked((here / "a.html").read_text(encoding="utf-8")).column("0.steps").ravel().tolist() == [10, 15, 20]


def test_a_cut_off_recording_says_so(fireworld, here, small):
    write_log(here / "cut.mcap", small, last=9)
    done = fireworld("play", "cut.mcap", "-o", "cut.html")
    assert done.code == 0
    assert done.err.endswith("; showing 10 committed steps\n")
    assert unpacked((here / "cut.html").read_text(encoding="utf-8")).words["runs"][0]["damage"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("a.mcap", "-o", "a.txt"), "a.txt: expected a file ending in .html, .htm, got '.txt'"),
        (("a.mcap", "-o", "none/a.html"), "none/a.html: expected an existing folder none, got 'none'; make it first"),
        (("a.mcap", "-o", "a.mcap", "--force"), "expected a file of its own for every input and output"),
        (("absent.mcap", "-o", "a.html"), "absent.mcap: cannot be read"),
        (("a.mcap", "a.mcap", "a.mcap", "-o", "a.html"), "Expected one or two recordings, got 3"),
        (("a.mcap", "other.mcap", "-o", "a.html"), "recordings: expected two of one city"),
        (("a.mcap", "-o", "a.html", "--from", "90"), "expected steps from 0 to 40, got steps 90 to 40"),
        (("a.mcap", "-o", "mine.html"), "got an existing file; use --force to replace it"),
    ],
    ids=lambda words: " ".join(words) if isinstance(words, tuple) else "",
)
def test_mistakes_take_one_line(fireworld, here, small, words, message):
    write_log(here / "a.mcap", small)
    write_log(here / "other.mcap", make_recording(5, 5, 3))
    (here / "mine.html").write_text("mine")
    before = sorted(path.name for path in here.iterdir())
    done = fireworld("play", *words)
    assert (done.code, done.out) == (2, "")
    assert message in done.err
    assert sorted(path.name for path in here.iterdir()) == before
    assert (here / "mine.html").read_text() == "mine"


def test_a_recording_without_steps_is_refused(small):
    with pytest.raises(ViewError, match="recording: expected one with steps"):
        page_of(MemoryRecording(small.header, small.city, []))
