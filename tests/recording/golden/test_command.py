"""`fireworld golden`: add, check, update, and everything that can be wrong."""

from __future__ import annotations

import dataclasses
import json
import signal
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fireworld_recorder.reader import open_log
from fireworld_recorder.writer import LogWriter

from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.words import N_STATES
from fireworld.recording.golden import check, store
from fireworld.recording.golden.find import find_goldens
from fireworld.recording.golden.store import store_text, text_path
from fireworld.recording.golden.update import update_goldens
from tests import command_line

MINE = ("add", "quick", "--policy", "mine:Policy", "--steps", 8)


@pytest.fixture
def kept(here, golden):
    """A folder of two goldens: one of a policy of the user's own, one of a shipped policy."""
    assert golden(*MINE).code == 0
    assert golden("add", "quick", "--policy", "easiest", "--steps", 4).code == 0
    return here / "recordings" / "golden"


def report():
    """Read report.xml, of this test's own making."""
    return ElementTree.parse("report.xml")


def contents(folder):
    """All files of a folder by name."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_add_writes_a_recording_and_its_text(kept):
    assert sorted(contents(kept)) == [
        "quick-easiest.mcap",
        "quick-easiest.txt",
        "quick-mine-Policy.mcap",
        "quick-mine-Policy.txt",
    ]
    log = open_log(kept / "quick-mine-Policy.mcap")
    assert (log.header.policy, log.header.seed, len(log)) == ("mine:Policy", 1, 9)


def test_the_text_tells_what_happened(kept):
    text = (kept / "quick-mine-Policy.txt").read_text()
    log = open_log(kept / "quick-mine-Policy.mcap")
    assert "scenario   quick\n" in text
    assert "policy     mine:Policy\nseed       1\nsteps      8 of at most 8, still burning\n" in text
    targets = [int(record.decisions.target[1]) for record in log if record.step]
    assert f"brigade 1: 8 M\n    1  MMMMMMMM\n       targets from step: 1 {targets[0]}" in text
    assert text.endswith(f"\nhash {log.digest}\n")
    first = next(record for record in log if len(record.events.kind))
    assert first.events.kind[0] == 1  # extinguished
    assert f"\n{first.step:>5}  extinguished {first.events.entity[0]}\n" in text


def test_nothing_has_changed(kept, golden):
    done = golden("check")
    assert done.code == 0
    assert done.out.count(" same") == 2
    assert "update" not in done.out


def test_a_changed_policy_is_found_and_told(kept, golden, change_policy):
    change_policy("EASIEST")
    done = golden("check")
    assert done.code == 1
    assert "quick-mine-Policy: policy changed; step 1, choose: brigade 0 chose easiest, was nearest-to-me\n" in done.out
    assert "  changed: policy: mine:Policy, digest " in done.out
    assert "; scenario, seed and simulator are the same\n" in done.out
    assert 'If that is meant: fireworld golden update --reason "..."' in done.out
    assert "quick-easiest: " not in done.out


def test_json(kept, golden, change_policy):
    change_policy("EASIEST")
    done = golden("check", "recordings/golden", "--json")
    same, different = json.loads(done.out)
    assert done.code == 1
    assert (same["name"], same["result"], same["first"]) == ("quick-easiest", "same", None)
    assert (different["result"], different["policy"], different["seed"]) == ("different", "mine:Policy", 1)
    assert (different["first"]["step"], different["first"]["a"], different["first"]["b"]) == (1, 3, 0)
    assert "policy_digest" in different["header"]
    assert list(different["cause"]["changes"]) == ["policy"]


def test_junit(kept, golden, write_policy):
    write_policy("raise RuntimeError('<lost>')")
    (kept / "quick-easiest.mcap").rename(kept / "easy\x1b.mcap")
    (kept / "quick-easiest.txt").rename(kept / "easy\x1b.txt")
    assert golden("check", "--junit", "report.xml").code == 2
    suite = report().find("testsuite")
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("2", "0", "1")
    same, broken = suite
    assert (same.get("name"), len(same)) == ("easy?", 0)
    assert "RuntimeError: <lost>" in broken.find("error").get("message")
    refused = golden("check", "--junit", "report.xml")
    assert (refused.code, refused.out) == (2, "")
    assert "report.xml: expected a name that is free" in refused.err
    assert golden("check", "--junit", "report.xml", "--force").out


def test_junit_of_a_difference(kept, golden, change_policy):
    change_policy("EASIEST")
    assert golden("check", "--junit", "report.xml").code == 1
    (case,) = [case for case in report().iter("testcase") if case.find("failure") is not None]
    failure = case.find("failure")
    assert failure.get("message") == "policy changed; step 1, choose: brigade 0 chose easiest, was nearest-to-me"
    assert float(case.get("time")) > 0
    assert (case.get("file"), case.get("line")) == ("recordings/golden/quick-mine-Policy.mcap", "1")


def test_keep_records_the_new_runs_that_differ(kept, golden, here, change_policy, monkeypatch):
    change_policy("EASIEST")
    assert golden("check", "--keep", "new").code == 1
    kept_files = {"quick-mine-Policy" + end for end in (".mcap", ".html", "-difference.html", ".png")}
    assert {path.name for path in (here / "new").iterdir()} == kept_files
    pair = kept / "quick-mine-Policy.mcap", here / "new" / "quick-mine-Policy.mcap"
    assert command_line.call(monkeypatch, "diff", *pair).code == 1
    before = contents(kept)
    assert golden("check", "--keep", "new").code == 2
    assert golden("check", "--keep", "new", "--force").code == 1
    refused = golden("check", "--keep", "recordings/../recordings/golden")
    assert (refused.code, contents(kept)) == (2, before)
    assert "recordings/../recordings/golden: expected another folder" in refused.err


def test_keep_shows_runs_that_begin_otherwise(here, golden, monkeypatch):
    scenario = command_line.call(monkeypatch, "scenarios", "show", "quick", "--yaml").out
    (here / "own.yaml").write_text(scenario)
    assert golden("add", "own.yaml", "--policy", "chief", "--steps", 4, "--dir", "kept", "--name", "own").code == 0
    (here / "own.yaml").write_text(scenario.replace("civilians:\n  n: 4", "civilians:\n  n: 3"))
    done = golden("check", "--dir", "kept", "--keep", "new", "--summary", "new.md")
    assert done.code == 1, done.err
    assert "changed: scenario: civilians.n: 3, was 4" in done.out
    assert {path.name for path in (here / "new").iterdir()} == {"own.mcap", "own.html"}
    assert "[page that plays](new/own.html)" in (here / "new.md").read_text()


def test_update_renews_what_changed_and_keeps_the_reason(kept, golden, change_policy):
    before = contents(kept)
    change_policy("EASIEST")
    done = golden("update", "--reason", "The easiest\n fire first.")
    assert (done.code, done.out.splitlines()[-1]) == (0, "1 changed, 1 the same")
    after = contents(kept)
    assert {name for name in before if before[name] != after[name]} == {
        "quick-mine-Policy.mcap",
        "quick-mine-Policy.txt",
    }
    assert (
        after["REASONS.md"]
        .decode()
        .endswith(
            "\n* The easiest fire first.\n"
            "  * quick-mine-Policy: step 1, choose: brigade 0 chose easiest, was nearest-to-me\n"
        )
    )
    assert golden("check").code == 0
    change_policy("NEAREST_TO_CENTER")
    golden("update", "--reason", "No: the center.")
    reasons = (kept / "REASONS.md").read_text()
    assert reasons.index("The easiest fire first.") < reasons.index("No: the center.")


def test_update_of_what_is_the_same_writes_nothing(kept, golden):
    before = contents(kept)
    done = golden("update", "--reason", "None.")
    assert (done.code, done.out, contents(kept)) == (0, "0 changed, 2 the same\n", before)


def test_update_of_those_named(kept, golden, change_policy):
    change_policy("EASIEST")
    assert golden("update", "quick-easiest", "--reason", "Only that.").out == "0 changed, 1 the same\n"
    assert golden("check").code == 1
    done = golden("update", "quick-mine", "--reason", "What?")
    assert (done.code, done.out) == (2, "")
    assert "the name of a golden, got 'quick-mine'; try quick-mine-Policy" in done.err


@pytest.mark.parametrize("reason", [(), ("--reason", ""), ("--reason", " \n")])
def test_update_needs_a_reason(kept, golden, change_policy, reason):
    change_policy("EASIEST")
    before = contents(kept)
    done = golden("update", *reason)
    assert (done.code, contents(kept)) == (2, before)
    assert "reason" in done.err


def test_update_writes_nothing_unless_all_can_be_run(kept, golden, write_policy):
    golden("add", "quick", "--policy", "random", "--steps", 4, "--set", "brigades.n=3", "--name", "other")
    before = contents(kept)
    write_policy("")
    done = golden("update", "--reason", "Tidied up.")
    assert (done.code, contents(kept)) == (2, before)
    assert "quick-mine-Policy: --policy: mine: expected a class of that name, got 'Policy'" in done.err
    assert "nothing is updated" in done.err


def test_update_interrupted_while_it_writes_finishes_that(kept, golden, change_policy, monkeypatch):
    change_policy("EASIEST")
    store_recording = store.store_recording

    def interrupted(path, fresh, *, free):
        signal.raise_signal(signal.SIGINT)
        store_recording(path, fresh, free=free)

    monkeypatch.setattr(store, "store_recording", interrupted)
    assert golden("update", "--reason", "The easiest fire first.").code == 0
    assert golden("check").code == 0


def test_check_interrupted(kept, golden, monkeypatch):
    def interrupted(run):
        raise KeyboardInterrupt

    monkeypatch.setattr(check, "run_again", interrupted)
    before = contents(kept)
    assert golden("check").code == 130
    assert golden("update", "--reason", "None.").code == 130
    assert contents(kept) == before


def test_a_text_of_another_recording_is_found(kept, golden):
    (kept / "quick-easiest.txt").write_bytes((kept / "quick-mine-Policy.txt").read_bytes())
    done = golden("check")
    assert done.code == 1
    assert "quick-easiest.txt: expected the text of this recording" in done.out
    done = golden("update", "--reason", "A wrong merge.")
    assert "quick-easiest: the same; its text is written anew" in done.out
    assert golden("check").code == 0


def test_a_text_worded_otherwise_is_no_difference(kept, golden):
    """Another fireworld may tell the same in other words."""
    path = kept / "quick-easiest.txt"
    path.write_text(path.read_text().replace("still burning", "burning still"))
    assert golden("check").code == 0
    assert store_text(kept / "quick-easiest.mcap")
    assert "still burning" in path.read_text()


def test_a_scenario_of_ones_own_is_run_as_it_is_now(here, golden, monkeypatch):
    scenario = command_line.call(monkeypatch, "scenarios", "show", "quick", "--yaml").out
    (here / "fires").mkdir()
    (here / "fires" / "own.yaml").write_text(scenario)
    assert golden("add", "fires/own.yaml", "--policy", "random", "--steps", 4, "--dir", "kept").code == 0
    (here / "elsewhere").mkdir()
    monkeypatch.chdir(here / "elsewhere")
    assert golden("check", here / "kept").code == 0, "found from the golden, not from the current folder"
    (here / "fires" / "own.yaml").write_text(scenario.replace("power_litres: 2000", "power_litres: 1000"))
    done = golden("check", here / "kept")
    assert done.code == 1
    assert "changed: scenario: parameters.brigades.power_litres: 1000, was 2000; policy, seed and" in done.out
    (here / "fires" / "own.yaml").unlink()
    done = golden("check", here / "kept")
    assert done.code == 2
    assert "fires/own.yaml: expected a scenario file, got No such file" in " ".join(done.out.split())


def test_settings_are_kept_and_told(here, golden):
    golden("add", "quick", "--policy", "random", "--set", "brigades.n=3", "--steps", 4, "--seed", 7)
    assert golden("check").code == 0
    text = (here / "recordings" / "golden" / "quick-random-seed-7.txt").read_text()
    assert "scenario   quick, brigades.n=3\n" in text
    assert "brigade 2: " in text


def test_a_team_file_is_found_from_the_golden(here, golden, monkeypatch):
    tables = np.random.default_rng(1).random((2, N_STATES, 4))
    TableTeam(tables=tables, visits=np.zeros(tables.shape, dtype=np.int64)).save(here / "team.npz")
    assert golden("add", "quick", "--policy", "team.npz", "--steps", 4, "--dir", "kept").code == 0
    (here / "elsewhere").mkdir()
    monkeypatch.chdir(here / "elsewhere")
    assert golden("check", here / "kept").code == 0
    TableTeam(tables=-tables, visits=np.zeros(tables.shape, dtype=np.int64)).save(here / "team.npz", force=True)
    done = golden("check", here / "kept")
    assert done.code == 1
    assert "quick-team: policy changed; step 1, choose: brigade 0 " in done.out


def test_a_plain_recording_is_run_again_as_recorded(here, golden, write_policy, monkeypatch):
    command_line.call(monkeypatch, "run", "quick", "--policy", "mine:Policy", "--steps", 5, "--record", "plain.mcap")
    done = golden("check", ".")
    assert done.code == 1
    assert "plain.txt: expected the text of this recording" in done.out
    assert golden("update", "--dir", ".", "--reason", "Kept from now on.").code == 0
    assert golden("check", ".").code == 0
    write_policy("")
    assert golden("check", ".").code == 2


def test_an_order_that_is_none(here, golden, kept):
    log = open_log(kept / "quick-easiest.mcap")
    header = dataclasses.replace(log.header, attachments={**log.header.attachments, "golden.json": b'{"seed": -1}'})
    with LogWriter(here / "odd.mcap", header, log.city) as writer:
        for record in log:
            writer.write(record)
    done = golden("check", ".")
    assert done.code == 2
    assert "odd: golden.json: " in done.out


def test_a_damaged_golden_cannot_be_checked(kept, golden):
    path = kept / "quick-easiest.mcap"
    path.write_bytes(path.read_bytes()[:-1000])
    done = golden("check")
    assert done.code == 2
    assert "quick-easiest: recordings/golden/quick-easiest.mcap: " in done.out
    assert done.out.count(" same") == 1


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("check",), "recordings/golden: expected a folder of goldens (*.mcap, *.digest), got no such folder"),
        (("check", "."), ".: expected a folder of goldens (*.mcap, *.digest), got a folder without any"),
        (("update", "--reason", "x"), "recordings/golden: expected a folder of goldens"),
        (("add", "quick"), "Missing option '--policy'"),
        (("add", "quack", "--policy", "easiest"), "scenario: expected the name of a scenario or a .yaml file"),
        (("add", "quick", "--policy", "easist"), "try easiest"),
        (("add", "quick", "--policy", "mine:Nobody"), "mine: expected a class of that name"),
        (("add", "quick", "--policy", "easiest", "--set", "brigades.m=1"), "brigades.m"),
        (("add", "quick", "--policy", "easiest", "--name", "../up"), "name: expected letters, digits"),
        (("add", "quick", "--policy", "easiest", "--dir", "mine.py/x"), "mine.py/x: cannot be made"),
    ],
)
def test_complaints(here, golden, words, complaint):
    done = golden(*words)
    assert (done.code, done.out) == (2, "")
    assert complaint in done.err
    assert sorted(contents(here)) == ["mine.py"]


def test_add_replaces_nothing(kept, golden):
    before = contents(kept)
    done = golden(*MINE)
    assert (done.code, contents(kept)) == (2, before)
    assert "quick-mine-Policy.mcap: expected a name that is free, got an existing golden; `fireworld golden" in done.err


def test_goldens_are_listed_by_name(kept):
    assert [path.stem for path in find_goldens(kept)] == ["quick-easiest", "quick-mine-Policy"]
    assert text_path(kept / "a.b.mcap").name == "a.b.txt"


def test_the_same_order_gives_the_same_files(here, golden):
    for folder in ("one", "two"):
        golden("add", "quick", "--policy", "random", "--steps", 3, "--dir", folder)
    assert contents(here / "one") == contents(here / "two")


def test_json_of_what_cannot_be_run(kept, golden, write_policy):
    write_policy("")
    done = golden("check", "--json")
    assert done.code == 2
    broken = json.loads(done.out)[1]
    assert (broken["result"], broken["first"], broken["totals"]) == ("cannot", None, None)
    assert "expected a class of that name" in broken["sentence"]


def test_help_imports_nothing_heavy():
    script = "import sys; sys.argv[1:] = ['golden', 'check', '--help']; from fireworld.cli import main\n"
    script += "try: main()\nfinally: print(*sys.modules, sep='\\n')"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "Exit code: 0 all the same, 1 one is different, 2 one cannot be run" in done.stdout
    assert not {"numpy", "numba", "rich", "mcap", "msgspec", "yaml"} & set(done.stdout.splitlines())


def test_a_policy_in_a_file_of_code(here, golden, monkeypatch):
    """It is found by its path from the golden, from wherever goldens are checked."""
    assert golden("add", "quick", "--policy", "mine.py:Policy", "--steps", 4, "--dir", "kept", "--name", "a").code == 0
    log = open_log(here / "kept" / "a.mcap")
    assert log.header.policy == "../mine.py:Policy"
    (here / "elsewhere").mkdir()
    monkeypatch.chdir(here / "elsewhere")
    assert golden("check", "../kept").code == 0


CHEAT = """
from fireworld.policy.protocol import Action, Decision

class Policy:
    def decide(self, observation):
        observation.world.fire.energy.base[:] = 0.0
        return Decision(Action.EASIEST)
"""


def test_a_policy_that_changes_its_world_makes_no_golden(kept, golden, write_policy):
    before = contents(kept)
    write_policy(CHEAT)
    wanted = "policy mine:Policy: seed {}: expected decisions that lead to its outcome by themselves"
    done = golden("check", "--junit", "junit.xml")
    assert done.code == 2
    assert wanted.format(1) in done.out
    assert "<error " in Path("junit.xml").read_text()
    done = golden("update", "--reason", "None.")
    assert (done.code, contents(kept)) == (2, before)
    done = golden("add", "quick", "--policy", "mine:Policy", "--seed", 3, "--name", "cheat")
    assert (done.code, contents(kept)) == (2, before)
    assert wanted.format(3) in done.err


def test_an_update_that_was_killed_is_finished_by_another(kept, golden, change_policy, monkeypatch):
    """The reason is there once, whatever of the goldens was written."""
    change_policy("EASIEST")

    def killed(*_, **__):
        raise SystemExit(9)

    for moment in ("store_recording", "store_text"):
        with monkeypatch.context() as patched:
            patched.setattr(store, moment, killed)
            with pytest.raises(SystemExit):
                update_goldens(kept, reason="Easier.")
    assert golden("update", "--reason", "Easier.").code == 0
    assert golden("check").code == 0
    text = (kept / "REASONS.md").read_text()
    assert text.count("* Easier.") == 1
    assert text.count("  * quick-mine-Policy: ") == 1


def test_goldens_are_listed_and_removed(kept, golden):
    (kept / "gone.txt").write_bytes((kept / "quick-easiest.txt").read_bytes())
    (kept / "notes.txt").write_text("not of a golden\n")
    (kept / "new.mcap.partial").write_bytes(b"")
    (kept / "newer.mcap.storing").write_bytes(b"")
    (kept / "bad.mcap").write_bytes(b"no log")
    done = golden("list")
    assert done.code == 0
    assert [line.split()[:4] for line in done.out.splitlines()[2:5]] == [
        ["bad", "-", "-", "0"],
        ["quick-easiest", "quick", "easiest", "1"],
        ["quick-mine-Policy", "quick", "mine:Policy", "1"],
    ]
    assert "bad.mcap" in done.out
    assert done.out.count(": left over; fireworld golden remove --leftovers") == 3
    found = json.loads(golden("list", "--json").out)
    assert [Path(path).name for path in found["leftovers"]] == ["gone.txt", "new.mcap.partial", "newer.mcap.storing"]
    assert [len(one["digest"]) for one in found["goldens"]] == [0, 64, 64]
    done = golden("remove", "bad", "quick-easy")
    assert (done.code, "try quick-easiest" in done.err) == (2, True)
    assert golden("remove").code == 2
    assert golden("remove", "bad", "quick-easiest", "--leftovers").code == 0
    assert sorted(contents(kept)) == ["notes.txt", "quick-mine-Policy.mcap", "quick-mine-Policy.txt"]
    assert golden("remove", "--leftovers").out == "nothing is left over\n"


def test_a_policy_that_changes_the_folder_changes_no_other_golden(here, golden, write_policy):
    assert golden(*MINE).code == 0
    assert golden("add", "quick", "--policy", "easiest", "--steps", 4, "--name", "z").code == 0
    write_policy(
        "import os\n\n\nclass Policy:\n    def decide(self, observation):\n        os.chdir('/')\n        return 3\n"
    )
    assert golden("check").code == 0
