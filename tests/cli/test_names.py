"""Names of files: any bytes, too long, in folders without rights. A name is text, and an error is a line."""

from __future__ import annotations

import io
import os
import sys

import pytest

from fireworld.errors import OutputError
from fireworld.stdout import HarmlessOutput, PatientOutput

pytestmark = pytest.mark.slow
RUN = ("run", "quick", "--policy", "chief", "--steps", 2, "--record")
ODD = [os.fsdecode(name) for name in (b"\xff\xfe\x1b[31mred", b"\x1b]0;title\x07a\nb[x]", b"\xc3(")]


@pytest.mark.heavy
@pytest.mark.parametrize("odd", ODD, ids=repr)
def test_a_name_of_any_bytes_serves_every_output(here, fireworld_process, odd):
    a, b = f"{odd}a.mcap", f"{odd}b.mcap"
    for words, made in (
        ((*RUN, a), a),
        ((*RUN, b, "--seed", 2), b),
        (("diff", a, b, "--html", f"{odd}.html", "--junit", f"{odd}.xml"), f"{odd}.html"),
        (("export", a, "--parquet", f"{odd}out"), f"{odd}out"),
        (("report", a, b, "-o", f"{odd}r.html"), f"{odd}r.html"),
        (("play", a, b, "-o", f"{odd}p.html"), f"{odd}p.html"),
        (("render", a, "-o", f"{odd}.png"), f"{odd}.png"),
    ):
        done = fireworld_process(*words)
        assert done.code in {0, 1}, done.err
        assert (here / made).exists()
        assert "\x1b" not in done.out + done.err
        assert "\x07" not in done.out + done.err


@pytest.mark.parametrize("length", [247, 250, 252, 255, 300])
def test_a_name_that_is_too_long_is_refused_in_a_line(here, fireworld, length):
    for words in (RUN, ("scenarios", "show", "quick", "-o")):
        ending = ".mcap" if words is RUN else ".png"
        name = "n" * (length - len(ending)) + ending
        done = fireworld(*words, name)
        if done.code:
            assert (done.code, len(done.err.splitlines())) == (2, 1)
            assert "File name too long" in done.err
            assert "internal" not in done.err
        assert [path.name for path in here.iterdir()] == ([] if done.code else [name])
        for path in here.iterdir():
            path.unlink()


def test_both_outputs_are_written_or_none(here, fireworld, monkeypatch):
    fireworld(*RUN, "a.mcap")
    fireworld(*RUN, "b.mcap", "--seed", 2)

    def fails(*_):
        raise OutputError("d.html: cannot be written")

    monkeypatch.setattr("fireworld.recording.difference.write_file", fails)
    done = fireworld("diff", "a.mcap", "b.mcap", "--junit", "d.xml", "--html", "d.html")
    assert (done.code, done.err) == (2, "fireworld: d.html: cannot be written\n")
    assert sorted(path.name for path in here.iterdir()) == ["a.mcap", "b.mcap"]


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("stream", "wanted"),
    [
        (io.StringIO(), "a\\x1b[31mb\\x1b[2K\\x1b]0;t\\x07\\r\n\té\\udcff"),
        (Terminal(), "a\x1b[31mb\x1b[2K\\x1b]0;t\\x07\r\n\té\\udcff"),
    ],
    ids=["file", "terminal"],
)
@pytest.mark.parametrize("make", [PatientOutput, HarmlessOutput])
def test_control_characters_are_shown(stream, wanted, make):
    stream.truncate(0)
    stream.seek(0)
    text = "a\x1b[31mb\x1b[2K\x1b]0;t\x07\r\n\té\udcff"
    assert make(stream).write(text) == len(text)
    assert stream.getvalue() == wanted


def test_an_encoding_without_a_letter_shows_it(here, fireworld_process, monkeypatch):
    monkeypatch.setenv("PYTHONIOENCODING", "ascii")
    assert fireworld_process(*RUN, "é.mcap").code == 0
    assert sys.getfilesystemencoding() == "utf-8"
    assert (here / "é.mcap").exists()


TOWN = """
preset: paper
city: {generated: {columns: 6, rows: 6}}
fires: [{at: [0.5, 0.5], n_buildings: 3}]
steps: 5
"""


@pytest.mark.parametrize("odd", ODD[:1] + ODD[-1:], ids=repr)
def test_inputs_with_names_of_any_bytes_are_read(here, fireworld, odd):
    town, curriculum, log, training = f"{odd}s.yaml", f"{odd}c.yaml", f"{odd}.mcap", f"{odd}t.mcap"
    (here / town).write_text(TOWN)
    (here / curriculum).write_text("stages: [{name: one, cooperation: false, scenarios: [quick]}]")
    for words in (
        ("run", town, "--set", "steps=4", "--record", log),
        ("view", log, "--save", "a.rrd"),
        ("report", log, "-o", "a.html"),
        ("play", log, "-o", "p.html"),
        ("compare", "chief", "easiest", "--scenarios", town, "--seeds", 1, "--jobs", 1),
        ("train", curriculum, "--set", "n_episodes_max=1", "--jobs", 1, "-o", "t.npz", "--record", training),
        ("view", training, "--save", "t.rrd"),
        ("replay", training, "--scenario", "quick", "--episode", 0, "-o", f"{odd}e.mcap"),
        ("verify", f"{odd}e.mcap"),
    ):
        done = fireworld(*words)
        assert done.code == 0, done.err


def test_a_golden_of_a_name_that_is_no_text_is_refused_in_a_line(here, fireworld):
    (here / f"{ODD[0]}s.yaml").write_text(TOWN)
    done = fireworld("golden", "add", f"{ODD[0]}s.yaml", "--policy", "chief")
    assert (done.code, len(done.err.splitlines())) == (2, 1)
    assert "expected a name in UTF-8" in done.err
