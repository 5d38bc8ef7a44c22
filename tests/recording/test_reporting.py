"""What CI servers are told: Markdown and annotations, of what library and commands found."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

import fireworld as fw
from fireworld.annotations import annotation_lines
from fireworld.errors import OutputError
from fireworld.findings import Finding
from fireworld.markdown import LINES_SHOWN, SHOWN, escaped, markdown_page, markdown_table
from tests import command_line

ODD = Finding(
    name="a:b,c%",
    verdict="different",
    headline="policy changed: x|y",
    cause=["changed: <b>one</b>", "  two\r\nlines, 100 %"],
    first="step 1",
    file="some, folder/a:b.txt",
    line=7,
)


def test_annotations_are_escaped_as_the_server_reads_them():
    (line,) = annotation_lines([ODD])
    assert line == (
        "::error file=some%2C folder/a%3Ab.txt,line=7,title=a%3Ab%2Cc%25::"
        "policy changed: x|y%0Achanged: <b>one</b>%0A  two%0D%0Alines, 100 %25"
    )


def test_annotations_of_what_is_not_different():
    same, cannot = Finding(name="a", verdict="same"), Finding(name="b", verdict="cannot", headline="no such file")
    assert annotation_lines([same]) == []
    assert annotation_lines([same, cannot], cannot="warning") == ["::warning title=b::no such file"]


def test_markdown_shows_words_as_they_are():
    assert escaped("a_b *c* <d> [e](f) `g` #1 | x\ny") == (
        r"a\_b \*c\* \<d\> \[e\](f) \`g\` \#1 \| x y"
    )  # fmt: skip
    assert "@" not in escaped("@somebody")
    assert markdown_table(["", "a|b"], [["x", "1"]]) == "|  | a\\|b |\n| --- | ---: |\n| x | 1 |"
    assert markdown_table(["a", "b"], [], n_text=2) == "| a | b |\n| --- | --- |"


def test_the_cause_comes_first_then_the_difference_then_the_table():
    finding = Finding(
        name="a", verdict="different", headline="h", cause=["cause", "key"], first="first", heads=["", "A"],
        rows=[["score", "1"]], links={"page": "out/new dir/a.html"}, picture="out/new dir/a.png",
    )  # fmt: skip
    text = markdown_page("check", [Finding(name="b", verdict="same"), finding], beside=Path("out"))
    places = [text.index(part) for part in ("**cause**", "- key", "first", "| score | 1 |", "![a](", "[page](")]
    assert places == sorted(places)
    assert text.startswith("## check: 1 different, 1 the same\n\n### a\n")
    assert "![a](new%20dir/a.png)" in text
    assert "### b" not in text


def test_long_lists_are_cut():
    cause = [f"key {n}" for n in range(40)]
    text = markdown_page("check", [Finding(name="a", verdict="different", headline="h", cause=cause)] * 50)
    assert text.count("### a") == SHOWN
    assert text.count("\n\n- a: h") == 50 - SHOWN
    assert f"- and {40 - 1 - LINES_SHOWN} more" in text


@pytest.fixture
def pair(empty_folder):
    """Recordings of two policies."""
    for name in ("easiest", "nearest-to-me"):
        fw.run("quick", policy=name, steps=5, record=f"{name}.mcap")
    return Path("easiest.mcap"), Path("nearest-to-me.mcap")


def test_diff(pair, monkeypatch):
    words = ("diff", *pair, "--summary", "d.md", "--annotate", "github", "--junit", "d.xml")
    done = command_line.call(monkeypatch, *words)
    assert done.code == 1
    told = done.out.splitlines()[-1]
    assert told.startswith(
        "::error file=easiest.mcap,line=1,title=nearest-to-me.mcap against easiest.mcap::policy changed; "
    )
    text = Path("d.md").read_text()
    assert text.startswith(fw.diff(*pair).summary().rstrip())
    assert "**changed: policy: nearest-to-me, was easiest; scenario, seed and simulator are the same**" in text
    links = re.findall(r"\]\(([^)]*)\)", text)
    assert links == ["d-files/first.png", "d-files/play.html"]
    assert all(Path(link).stat().st_size > 10_000 for link in links)
    cases = list(ElementTree.parse("d.xml").iter("testcase"))
    assert {(case.get("file"), case.get("line")) for case in cases} == {("easiest.mcap", "1")}
    refused = command_line.call(monkeypatch, *words)
    assert (refused.code, refused.out) == (2, "")
    Path("d.xml").unlink()
    Path("d.md").unlink()
    with pytest.raises(OutputError, match=r"play\.html"):
        fw.diff(*pair).save_summary("d.md")
    assert command_line.call(monkeypatch, *words, "--force").code == 1


def test_diff_of_the_same(pair, monkeypatch):
    done = command_line.call(monkeypatch, "diff", pair[0], pair[0], "--summary", "d.md", "--annotate", "github")
    assert done.code == 0
    assert "::" not in done.out
    assert Path("d.md").read_text() == "## diff: 1 the same\n"
    assert not Path("d-files").exists()


def test_golden_check(empty_folder, monkeypatch):
    def golden(*words):
        return command_line.call(monkeypatch, "golden", *words)

    golden("add", "quick", "--policy", "random", "--steps", 3, "--name", "a")
    golden("add", "quick", "--policy", "easiest", "--steps", 3, "--name", "b", "--digest-only")
    done = golden("check", "--summary", "s.md", "--annotate", "github")
    assert (done.code, "::" in done.out) == (0, False)
    assert Path("s.md").read_text() == "## golden check: 2 the same\n"
    path = Path("recordings/golden/b.digest")
    path.write_text(path.read_text().replace('"digest": "', '"digest": "0'))
    done = golden("check", "--summary", "s.md", "--annotate", "github", "--force", "--keep", "new")
    assert done.code == 1
    (told,) = [line for line in done.out.splitlines() if line.startswith("::")]
    assert told.startswith("::error file=recordings/golden/b.digest,line=1,title=b::nothing recorded changed; ")
    links = re.findall(r"\]\(([^)]*)\)", Path("s.md").read_text())
    assert links == ["new/b.png", "new/b.html", "new/b.mcap"]
    assert all(Path(link).is_file() for link in links)
    assert golden("check", "--annotate", "github", "--json").code == 2


@pytest.mark.slow
def test_compare(empty_folder, monkeypatch):
    words = ("compare", "chief", "random", "--scenarios", "quick", "--seeds", 25, "--annotate", "github")
    done = command_line.call(monkeypatch, *words, "--summary", "c.md")
    told = done.out.splitlines()[-1]
    judged = re.match(r"::(error|warning) title=random against chief::(worse|cannot tell): score ", told)
    assert judged, done.out
    assert (judged[1] == "error") == (judged[2] == "worse")
    text = Path("c.md").read_text()
    assert text.startswith(f"## compare: 1 {judged[2]}\n\n### random against chief\n\n**policy: random (")
    assert "- scenarios: quick (" in text
    assert "| score | " in text
    assert Path("c-files/difference-1.png").is_file()
    same = fw.compare(["chief", "chief"], scenarios=["quick"], seeds=2)
    assert same.summary().startswith("## compare: 1 not worse\n")
    assert annotation_lines(same.findings()) == []
