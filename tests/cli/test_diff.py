"""`fireworld diff`: what it says, writes and refuses, and with which exit code."""

from __future__ import annotations

import builtins
import dataclasses
import importlib.util
import json
import re
import shutil
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest
from fireworld_recorder.reader import open_log

from tests.cli.test_help import ask, heavy
from tests.docs.pages import ROOT
from tests.recorder import synthetic
from tests.recorder.conftest import write_log
from tests.recorder.test_diff import altered

PAGE = ROOT / "docs" / "comparing-recordings.md"
TOPICS = ["draws", "observations", "decisions", "brigades", "buildings", "civilians", "rewards", "score", "events"]


@pytest.fixture(scope="module")
def records():
    return synthetic.run(30)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, records):
    """A golden, a run that differs from step 21 on, one of another city, scenario, length, and one cut off."""
    folder = tmp_path_factory.mktemp("diff")
    write_log(folder / "golden.mcap", records)
    other = altered(records, 21, "decisions", action=(1, 3))
    for step in range(22, 31):
        other = altered(other, step, "buildings", fieryness=(step - 22, 8), energy=(0, 1.0))
    write_log(folder / "new.mcap", other, header=synthetic.header(policy="random"))
    write_log(folder / "scenario.mcap", other, header=synthetic.header(scenario="two", scenario_digest="ef" * 32))
    write_log(folder / "city.mcap", records, city=dataclasses.replace(synthetic.city(), name="lane"))
    write_log(folder / "short.mcap", records[:25])
    write_log(folder / "renamed.mcap", records, header=synthetic.header(policy="random"))
    data = (folder / "golden.mcap").read_bytes()
    (folder / "cut.mcap").write_bytes(data[: len(data) // 2])
    return folder


@pytest.fixture
def diff(fireworld, folder, tmp_path, monkeypatch):
    """Call `fireworld diff` in a copy of the folder."""
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return lambda *words: fireworld("diff", *words)


def only_line(done):
    """The complaint of a command that could not be done."""
    assert (done.code, done.out) == (2, "")
    text = " ".join(done.err.split())
    return text.removeprefix("fireworld: ")


RANDOM = "changed: policy: random, was easiest; scenario and seed are the same; simulator is not known"


def test_the_same_run_is_told_in_a_line(diff, folder):
    digest = open_log(folder / "golden.mcap").digest
    done = diff("golden.mcap", "golden.mcap")
    assert (done.code, done.out, done.err) == (0, f"the same: 31 steps, digest {digest}\n", "")
    done = diff("golden.mcap", "renamed.mcap")
    assert (done.code, done.out) == (0, f"the same: 31 steps, digest {digest}\n{RANDOM}\n")


def test_the_same_run_needs_no_table_and_no_simulator(folder):
    code, _, modules = ask("diff", str(folder / "golden.mcap"), str(folder / "golden.mcap"))
    assert code == 0
    assert set(heavy(modules)) == {"numpy", "mcap"}
    assert "fireworld_recorder.diff" not in modules


def test_a_difference_and_how_it_spread(diff):
    done = diff("golden.mcap", "new.mcap")
    assert done.code == 1
    lines = done.out.splitlines()
    assert lines[:2] == [RANDOM, "step 21, choose: brigade 1 chose nearest-to-me, was nearest-to-civilian"]
    assert [line.split() for line in lines if line.startswith("/")] == [
        ["/decisions", "21", "1"],
        ["/buildings", "22", "9"],
    ]
    table = [line.split() for line in lines if re.match(r" *\d+ ", line)]
    assert [row[:5] for row in table] == [
        ["21", "0", "0", "1", "0"],
        ["22", "1", "1", "0", "0"],
        ["23", "2", "1", "0", "0"],
        ["26", "2", "1", "0", "0"],
        ["30", "2", "1", "0", "0"],
    ]
    assert "brigades: 1 of 3 differed at some step, the first at step 21, choose: brigade 1 chose" in done.out
    assert "civilians: none of 4 differed" in lines


def test_what_is_ignored_makes_no_difference(diff):
    assert diff("golden.mcap", "new.mcap", "--ignore", "decisions").code == 1
    done = diff(
        "golden.mcap", "new.mcap", "--ignore", "decisions", "--ignore", "buildings.energy", "--ignore", "fieryness"
    )
    assert done.code == 0
    assert done.out.startswith("the same: 31 steps\n")


@pytest.mark.parametrize(
    ("range_", "code", "words"),
    [
        (["--to", "20"], 0, "the same: 21 steps"),
        (["--from", "22"], 1, "step 22, fire: "),
        (["--from", "5", "--to", "5"], 0, "the same: 1 steps"),
    ],
)
def test_a_range_of_steps(diff, range_, code, words):
    done = diff("golden.mcap", "new.mcap", *range_)
    assert done.code == code
    assert done.out.removeprefix(f"{RANDOM}\n").startswith(words)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--ignore", "building"], "ignore: expected a field of the log, got 'building'; try buildings"),
        (["--ignore", "buildings.temprature"], "try buildings.temperature"),
        (["--tolerance", "temprature=1"], "try temperature"),
        (["--from", "9", "--to", "8"], "expected a range of steps, got 9 to 8"),
        (["--from", "31"], "expected a range of the steps 0 to 30, got steps 31 to the last"),
        (["--from", "-1"], "--from"),
        (["--force"], "--force goes with --junit, --html or --summary"),
        (["--junit", "missing/out.xml"], "expected an existing folder missing"),
        (["--junit", "."], "expected the name of a file"),
        (["--html", "short.mcap"], "short.mcap: expected a name that is free"),
        (["--html", "new.mcap", "--force"], "expected a file of its own for every input and output"),
        (["--html", "out", "--junit", "out"], "expected a file of its own for every input and output"),
    ],
)
def test_what_is_refused(diff, options, words):
    assert words in only_line(diff("golden.mcap", "new.mcap", *options))


def test_a_link_is_not_replaced(diff, tmp_path):
    (tmp_path / "link.xml").symlink_to(tmp_path / "golden.mcap")
    assert "the name of a regular file" in only_line(diff("golden.mcap", "new.mcap", "--junit", "link.xml", "--force"))


def test_runs_of_different_scenarios(diff):
    line = only_line(diff("golden.mcap", "scenario.mcap"))
    assert "synthetic (abababababab) in golden.mcap and two (efefefefefef) in scenario.mcap: " in line
    assert line.endswith("; try --any-scenario if that is meant")
    done = diff("golden.mcap", "scenario.mcap", "--any-scenario")
    assert done.code == 1
    assert "scenario: two (efefefefefef), was synthetic (abababababab)" in done.out


def test_runs_in_different_cities(diff, tmp_path):
    line = only_line(diff("golden.mcap", "city.mcap", "--any-scenario", "--junit", "out.xml"))
    assert line == (
        "cannot compare runs in different cities, row in golden.mcap and lane in city.mcap: city: name is lane, was row"
    )
    assert not (tmp_path / "out.xml").exists()
    assert diff("golden.mcap", "city.mcap", "--ignore", "city.name").code == 0


def test_a_cut_off_recording(diff, folder):
    last = int(open_log(folder / "cut.mcap", partial=True).steps[-1])
    line = only_line(diff("golden.mcap", "cut.mcap"))
    assert line.startswith("cut.mcap: partial: the file ends ")
    assert f"good up to step {last}; try --partial" in line
    assert "fireworld recover cut.mcap" in line
    done = diff("golden.mcap", "cut.mcap", "--partial")
    assert (done.code, done.out.splitlines()[0]) == (0, f"the same: {last + 1} steps")
    assert f"good up to step {last}; nothing is compared beyond" in done.err
    both = diff("cut.mcap", "cut.mcap", "--partial")
    assert both.code == 0
    assert "nothing is compared beyond" in both.err
    facts = json.loads(diff("golden.mcap", "cut.mcap", "--partial", "--json").out)
    assert [facts["recordings"][k]["state"] for k in (0, 1)] == ["complete", "partial"]
    assert facts["n_steps_compared"] == last + 1


def test_missing_and_foreign_files(diff, tmp_path):
    assert "missing.mcap: cannot be read: No such file" in only_line(diff("missing.mcap", "new.mcap"))
    assert "missing.mcap: cannot be read: No such file" in only_line(diff("golden.mcap", "missing.mcap"))
    (tmp_path / "text.mcap").write_text("hello world")
    assert "text.mcap: expected an MCAP recording" in only_line(diff("text.mcap", "text.mcap"))


def paths_of(value, path=""):
    """Yield the path of every value in JSON: keys that are names of things stand for their kind."""
    kinds = {
        "cause.changes": "WHAT", "header": "KEY", "n_steps_differing": "TOPIC", "first_by_topic": "TOPIC",
        "spread.n_entities": "KIND", "spread.n_reached": "KIND", "spread.first_by_entity": "KIND",
    }  # fmt: skip
    if path in {"first_by_topic.TOPIC", "spread.first_by_entity.KIND"}:
        yield path
        yield from (
            found.replace(path, "first", 1) for key in value or () for found in paths_of(value[key], f"{path}.{key}")
        )
    elif isinstance(value, dict):
        yield from [path] if path == "first" else []
        for key in value:
            yield from paths_of(value[key], f"{path}.{kinds.get(path, key)}".lstrip("."))
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        yield from (found for item in value for found in paths_of(item, f"{path}[]"))
    else:
        yield path


def test_every_key_of_the_json_is_documented_and_every_documented_key_is_there(diff):
    documented = re.findall(r"^\| `([\w.\[\]]+)` \| [a-z ]+ \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(documented) == len(set(documented)) > 30
    facts = json.loads(diff("golden.mcap", "new.mcap", "--json").out)
    assert set(paths_of(facts)) == set(documented)
    for words in (["short.mcap"], ["golden.mcap"], ["renamed.mcap"]):
        assert set(paths_of(json.loads(diff("golden.mcap", *words, "--json").out))) <= {*documented, "header", *EMPTY}


EMPTY = {"n_steps_differing", "first_by_topic", "spread.rows", "first"}
"""Keys whose values may be empty or null."""


def test_the_json_of_two_recordings(diff):
    facts = json.loads(diff("golden.mcap", "new.mcap", "--json").out)
    assert facts["same"] is False
    assert facts["first"]["sentence"].startswith("step 21, choose: brigade 1")
    assert facts["header"] == {"policy": ["easiest", "random"]}
    assert facts["cause"]["changes"] == {"policy": ["random, was easiest"]}
    assert facts["cause"]["same"] == ["scenario", "seed"]
    assert facts["cause"]["unknown"] == ["simulator"]
    assert facts["n_steps_differing"] == {"/decisions": 1, "/buildings": 9}
    assert facts["spread"]["n_reached"] == {"building": 9, "brigade": 1, "civilian": 0}
    assert facts["spread"]["rows"][1]["score"] == [4.5, 4.5]
    assert facts["recordings"][1] == {"path": "new.mcap", "state": "complete", "damage": None}
    assert diff("golden.mcap", "new.mcap", "--json").out == json.dumps(facts, indent=2) + "\n"


def junit(path):
    """Read a file as CI servers do: counts of the suite, and the cases by name."""
    root = ElementTree.parse(path).getroot()
    assert root.tag == "testsuites"
    (suite,) = root.findall("testsuite")
    assert suite.get("name")
    assert all(root.get(key) == suite.get(key) for key in ("tests", "failures", "errors", "skipped"))
    cases = {case.get("name"): case for case in suite.findall("testcase")}
    assert len(cases) == len(suite.findall("testcase")) == int(suite.get("tests"))
    for kind, key in (("failure", "failures"), ("skipped", "skipped"), ("error", "errors")):
        assert sum(case.find(kind) is not None for case in cases.values()) == int(suite.get(key))
    assert all(case.get("classname") and case.get("time") == "0" for case in cases.values())
    return suite, cases


def test_junit_has_a_case_for_each_topic(diff, tmp_path):
    done = diff("golden.mcap", "new.mcap", "--junit", "out.xml", "--ignore", "draws")
    assert (done.code, done.err) == (1, "wrote out.xml\n")
    suite, cases = junit(tmp_path / "out.xml")
    assert list(cases) == [*TOPICS, "snapshot", "commit", "length"]
    assert {name for name, case in cases.items() if case.find("failure") is not None} == {"decisions", "buildings"}
    assert {name for name, case in cases.items() if case.find("skipped") is not None} == {"draws", "snapshot"}
    failure = cases["decisions"].find("failure")
    assert failure.get("message") == "step 21, choose: brigade 1 chose nearest-to-me, was nearest-to-civilian"
    assert failure.text == f"{failure.get('message')}\ndiffers in 1 of 31 steps"
    assert {case.get("classname") for case in cases.values()} == {"fireworld.diff.golden"}
    assert suite.find("properties/property").attrib == {"name": "policy", "value": "random, was easiest"}


def test_junit_of_the_same_run_and_of_one_that_is_shorter(diff, tmp_path):
    assert diff("golden.mcap", "golden.mcap", "--junit", "out.xml").code == 0
    suite, cases = junit(tmp_path / "out.xml")
    assert (suite.get("failures"), len(cases)) == ("0", 12)
    assert diff("golden.mcap", "short.mcap", "--junit", "out.xml").code == 2
    assert diff("golden.mcap", "short.mcap", "--junit", "out.xml", "--force").code == 1
    failed = {name: case.find("failure") for name, case in junit(tmp_path / "out.xml")[1].items()}
    assert [name for name, failure in failed.items() if failure is not None] == ["length"]
    assert failed["length"].get("message").startswith("6 steps, 25 to 30, are only in the first run")


def test_junit_of_a_name_that_xml_cannot_hold(diff, tmp_path):
    name = "go\x01l&d<.mcap"
    shutil.copy(tmp_path / "golden.mcap", tmp_path / name)
    (tmp_path / "a.b").mkdir()
    shutil.copy(tmp_path / "new.mcap", tmp_path / "a.b" / "c.d.mcap")
    assert diff(name, "a.b/c.d.mcap", "--junit", "out.xml").code == 1
    suite, cases = junit(tmp_path / "out.xml")
    assert suite.get("name") == "go?l&d<.mcap and a.b/c.d.mcap"
    assert cases["draws"].get("classname") == "fireworld.diff.go_l_d_"
    assert diff("a.b/c.d.mcap", "golden.mcap", "--junit", "out.xml", "--force").code == 1
    assert junit(tmp_path / "out.xml")[1]["draws"].get("classname") == "fireworld.diff.a_b.c_d"


class Page(HTMLParser):
    """What a page holds, and what it would load."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.open, self.loaded, self.words = [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        if tag not in {"meta", "img"}:
            self.open.append(tag)
        self.loaded += [value for key, value in attributes if key in {"src", "href", "srcset", "data"}]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


@pytest.mark.slow
def test_the_page_holds_everything_itself(diff, tmp_path, monkeypatch):
    imported = builtins.__import__

    def without_viewer(name, *rest, **named):
        assert name.partition(".")[0] not in {"rerun", "numba"}
        return imported(name, *rest, **named)

    monkeypatch.setattr(builtins, "__import__", without_viewer)
    done = diff("golden.mcap", "new.mcap", "--html", "out.html", "--junit", "out.xml", "--json")
    assert (done.code, done.err) == (1, "wrote out.xml\nwrote out.html; open it in a browser\n")
    assert json.loads(done.out)["same"] is False
    text = (tmp_path / "out.html").read_text(encoding="utf-8")
    page = Page(text)
    assert page.open == []
    assert page.tags.count("img") == 5  # both maps and what differs, at two steps, and the curves
    assert page.tags.count("iframe") == 1
    assert all(source.startswith("data:image/png;base64,iVBOR") for source in page.loaded)
    outside = re.sub(r'srcdoc="[^"]*"', "", text)
    assert not re.search(r"url\(|@import|<script|https?:", outside)
    words = " ".join(page.words)
    assert "step 21, choose: brigade 1 chose nearest-to-me, was nearest-to-civilian" in words
    for heading in ("The first difference", "How it spread", "Curves", "The last step of both", "Topics"):
        assert heading in words
    assert "civilians: none of 4 differed" in words
    assert diff("golden.mcap", "new.mcap", "--html", "again.html").code == 1
    assert (tmp_path / "again.html").read_text(encoding="utf-8") == text
    assert sorted(path.name for path in tmp_path.glob("*.partial")) == []


def test_the_page_of_runs_without_a_differing_step(diff, tmp_path):
    assert diff("golden.mcap", "golden.mcap", "--html", "same.html").code == 0
    page = Page((tmp_path / "same.html").read_text(encoding="utf-8"))
    assert "31 steps are the same" in " ".join(page.words)
    assert page.tags.count("img") == 0
    shutil.copy(tmp_path / "short.mcap", tmp_path / "<b>.mcap")
    assert diff("golden.mcap", "<b>.mcap", "--html", "length.html").code == 1
    page = Page((tmp_path / "length.html").read_text(encoding="utf-8"))
    assert page.tags.count("img") == 1  # the curves: the runs have no differing step in common
    assert "<b>.mcap against golden.mcap" in page.words


def test_the_page_without_matplotlib(diff, tmp_path, monkeypatch):
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "matplotlib" else found(name))
    line = only_line(diff("golden.mcap", "new.mcap", "--html", "out.html"))
    assert line == "diff --html: matplotlib is not installed; try pip install 'fireworld[figures]'"
    assert not (tmp_path / "out.html").exists()
