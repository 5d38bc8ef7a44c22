"""`fireworld render`: pictures and films of recordings, their errors, and what is left after an interruption."""

from __future__ import annotations

import io
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from fireworld_viewer import colors
from fireworld_viewer.pictures import film
from fireworld_viewer.pictures.figure_files import plain_style
from fireworld_viewer.story.steps import read_steps_between
from PIL import Image

from fireworld.records import MemoryRecording
from tests import command_line
from tests.viewer.conftest import make_recording
from tests.viewer.recorded import write_log

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def logs(tmp_path_factory, small, slower):
    """a.mcap and b.mcap in one city, cut.mcap that ends after step 17, other.mcap in another city."""
    folder = tmp_path_factory.mktemp("logs")
    write_log(folder / "a.mcap", small)
    write_log(folder / "b.mcap", slower)
    write_log(folder / "cut.mcap", small, last=17)
    write_log(folder / "other.mcap", make_recording(5, 5, 3))
    return folder


@pytest.fixture
def render(monkeypatch, logs, tmp_path):
    """Call `fireworld render` in an empty folder; recordings are named by their file's name alone."""
    monkeypatch.chdir(tmp_path)

    def call(*words):
        named = [logs / word if str(word).endswith(".mcap") else word for word in words]
        done = command_line.call(monkeypatch, "render", *named)
        return replace(done, err=done.err.replace(f"{logs}/", ""))

    return call


def files(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_still(render, tmp_path):
    done = render("a.mcap", "-o", "still.png", "--step", "12")
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith("still.png: 1 step, ")
    with Image.open(tmp_path / "still.png") as picture:
        assert picture.format == "PNG"


def test_the_last_step_is_drawn_if_none_is_named(render, tmp_path):
    for name, words in (("none", ()), ("last", ("--step", "last")), ("forty", ("--step", "40"))):
        assert render("a.mcap", "-o", f"{name}.png", *words).code == 0
    assert len({(tmp_path / f"{name}.png").read_bytes() for name in ("none", "last", "forty")}) == 1


def test_a_strip_and_a_pair(render, tmp_path):
    assert render("a.mcap", "-o", "strip.png", "--steps", "0, 10,last").out.startswith("strip.png: 3 steps, ")
    assert render("a.mcap", "b.mcap", "-o", "pair.svg", "--step", "35").code == 0
    assert files(tmp_path) == ["pair.svg", "strip.png"]


def test_where_it_burns_or_the_whole_city(render, logs, tmp_path):
    """Of a city that burns in a corner the corner is drawn, and all of it on demand."""
    write_log(logs / "corner.mcap", make_recording(20, 20, 12))
    for name, words in (("part", ()), ("whole", ("--whole",))):
        assert render("corner.mcap", "-o", f"{name}.png", "--step", "12", *words).code == 0
        assert render("corner.mcap", "-o", f"{name}.gif", "--to", "2", *words).code == 0
    assert (tmp_path / "part.png").read_bytes() != (tmp_path / "whole.png").read_bytes()
    assert (tmp_path / "part.gif").read_bytes() != (tmp_path / "whole.gif").read_bytes()


def test_a_gif_plays_every_step_and_holds_the_last(render, tmp_path):
    done = render("a.mcap", "-o", "film.GIF", "--from", "2", "--to", "20", "--every", "4", "--fps", "5")
    assert done.out.startswith("film.GIF: 6 frames, steps 2 to 20, ")
    with Image.open(tmp_path / "film.GIF") as picture:
        assert picture.n_frames == 6
        durations = []
        for place in range(6):
            picture.seek(place)
            durations.append(picture.info["duration"])
    assert durations == [200] * 5 + [2000]


def test_the_frames_of_a_gif_are_the_pictures(small, tmp_path):
    """What is left of a frame after palette and differences is the frame, but for rounded colors."""
    shown = read_steps_between([small], first=0, last=30, every=10)
    with plain_style():
        film.save_film([small], shown, tmp_path / "film.gif")
        wanted = film.FilmFrames([small], shown).frame(2)
    with Image.open(tmp_path / "film.gif") as picture:
        picture.seek(2)
        seen = np.asarray(picture.convert("RGB")).astype(int)
    assert np.abs(seen - wanted.astype(int)).max() < 80
    assert np.abs(seen - wanted.astype(int)).mean() < 0.7
    for rgb in (*colors.FIERYNESS_RGB, *colors.ACTIVITY_RGB):
        there = (wanted == np.array(rgb)).all(axis=-1)
        assert (seen[there] == np.array(rgb)).all(), "what has a color of the table keeps it exactly"


def test_a_frame_does_not_depend_on_those_before(small):
    shown = read_steps_between([small], first=0, last=40, every=10)
    with plain_style():
        forward, backward = film.FilmFrames([small], shown), film.FilmFrames([small], shown)
        frames = [forward.frame(index) for index in range(len(forward))]
        for index in reversed(range(len(backward))):
            assert np.array_equal(backward.frame(index), frames[index])


def test_a_film_is_the_same_bytes_each_time(render, tmp_path):
    for name in ("one.gif", "two.gif"):
        render("a.mcap", "b.mcap", "-o", name, "--from", "28", "--to", "32")
    assert (tmp_path / "one.gif").read_bytes() == (tmp_path / "two.gif").read_bytes()


def test_an_mp4(render, tmp_path):
    av = pytest.importorskip("av")
    for name in ("one.mp4", "two.mp4"):
        assert render("a.mcap", "-o", name, "--to", "4", "--fps", "4").code == 0
    data = (tmp_path / "one.mp4").read_bytes()
    assert data == (tmp_path / "two.mp4").read_bytes()
    with av.open(io.BytesIO(data)) as played:
        (stream,) = played.streams.video
        assert (stream.codec_context.name, stream.average_rate) == ("h264", 4)
        frames = list(played.decode(stream))
    assert len(frames) == 5 + 7, "the last step stays for two seconds"


def test_a_cut_off_recording_is_drawn_as_far_as_it_is_good(render, tmp_path, small, monkeypatch):
    done = render("cut.mcap", "-o", "still.png")
    assert done.code == 0
    assert done.err.startswith("cut.mcap: ")
    assert done.err.endswith("; drawing 18 committed steps\n")
    write_log(tmp_path / "good.mcap", MemoryRecording(small.header, small.city, list(small)[:18]))
    good = command_line.call(monkeypatch, "render", tmp_path / "good.mcap", "-o", "whole.png", "--step", "17")
    assert good.code == 0
    assert (tmp_path / "still.png").read_bytes() == (tmp_path / "whole.png").read_bytes()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("a.mcap", "-o", "a.bmp"), "a.bmp: expected a file ending in .png, .svg, .pdf, .gif, .mp4, got '.bmp'"),
        (("a.mcap", "-o", "a"), "a: expected a file ending in .png, .svg, .pdf, .gif, .mp4, got no ending"),
        (("a.mcap", "-o", "none/a.png"), "none/a.png: expected an existing folder none, got 'none'; make it first"),
        (("a.mcap", "-o", "a.png", "--step", "41"), "step: expected a step from 0 to 40, got 41"),
        (("cut.mcap", "-o", "a.png", "--steps", "3,18"), "step: expected a step from 0 to 17, got 18"),
        (
            ("a.mcap", "-o", "a.gif", "--from", "50"),
            "--from and --to: expected steps from 0 to 40, got steps 50 to 40",
        ),
        (("a.mcap", "other.mcap", "-o", "a.png"), "recordings: expected two of one city, got 'grid' with 36 buildings"),
        (("absent.mcap", "-o", "a.png"), "absent.mcap: cannot be read"),
        (("a.mcap", "-o", "a.png", "--step", "-1"), "--step: expected steps like 0,60,last, got '-1'"),
        (("a.mcap", "-o", "a.png", "--step", "1,2"), "--step: expected one step, got '1,2'; several go with --steps"),
        (("a.mcap", "-o", "a.png", "--steps", "1,,2"), "--steps: expected steps like 0,60,last, got '1,,2'"),
        (("a.mcap", "-o", "a.png", "--steps", ",".join("1" * 25)), "--steps: expected at most 24 steps, got 25"),
        (("a.mcap", "-o", "a.png", "--step", "1", "--steps", "2"), "--step and --steps exclude each other"),
        (("a.mcap", "-o", "a.gif", "--step", "1"), "--step and --steps go with pictures, not with films (.gif)"),
        (("a.mcap", "-o", "a.png", "--fps", "3"), "go with films, not with pictures (.png)"),
        (("a.mcap", "a.mcap", "a.mcap", "-o", "a.png"), "Expected one or two recordings, got 3"),
    ],
    ids=lambda words: " ".join(words) if isinstance(words, tuple) else "",
)
def test_mistakes_take_one_line_and_leave_nothing(render, tmp_path, words, message):
    done = render(*words)
    assert (done.code, done.out) == (2, "")
    assert message in done.err
    assert files(tmp_path) == []


def test_a_file_is_not_replaced_unasked(render, tmp_path):
    for name in ("a.png", "a.gif"):
        (tmp_path / name).write_text("mine")
        done = render("a.mcap", "-o", name)
        assert (done.code, done.err) == (
            2,
            f"fireworld: {name}: expected a name that is free, got an existing file; use --force to replace it\n",
        )
        assert (tmp_path / name).read_text() == "mine"
    assert render("a.mcap", "-o", "a.png", "--force").code == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("absent", "name", "message"),
    [
        ("matplotlib", "a.png", "pictures: matplotlib is not installed; try pip install 'fireworld[figures]'"),
        ("matplotlib", "a.gif", "pictures: matplotlib is not installed; try pip install 'fireworld[figures]'"),
        ("av", "a.mp4", "film: PyAV, which writes .mp4, is not installed; try pip install 'fireworld[film]', or a"),
    ],
)
def test_a_missing_library_is_named(render, monkeypatch, tmp_path, absent, name, message):
    monkeypatch.setitem(sys.modules, absent, None)
    done = render("a.mcap", "-o", name)
    assert done.code == 2
    assert message in done.err
    assert files(tmp_path) == []


@pytest.mark.parametrize("ending", ["gif", "mp4"])
def test_an_interrupted_film_leaves_nothing(render, monkeypatch, tmp_path, ending):
    if ending == "mp4":
        pytest.importorskip("av")
    frame = film.FilmFrames.frame

    def interrupted(frames, index):
        if index == 5:
            raise KeyboardInterrupt
        return frame(frames, index)

    monkeypatch.setattr(film.FilmFrames, "frame", interrupted)
    done = render("a.mcap", "-o", f"film.{ending}", "--to", "12")
    assert (done.code, done.err.strip()) == (130, "interrupted")
    assert files(tmp_path) == []


def test_nothing_is_simulated_for_a_picture(logs, tmp_path):
    """Neither the simulator's compiler nor Rerun is needed."""
    ask = (
        "import sys; from fireworld.cli import main\n"
        f"sys.argv = ['fireworld', 'render', {str(logs / 'a.mcap')!r}, '-o', {str(tmp_path / 'a.png')!r}]\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "print(sorted({'numba', 'rerun', 'shapely', 'yaml'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
