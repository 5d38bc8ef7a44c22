"""Digest-only goldens: what they keep, what is still named when a run differs, and everything that can be wrong."""

from __future__ import annotations

import json

import pytest
from fireworld_recorder.reader import open_log

from fireworld.errors import LogError
from fireworld.recording.golden.digest import read_digest
from tests import command_line
from tests.recording.golden.conftest import POLICY

ADD = ("add", "quick", "--policy", "mine:Policy", "--steps", 8, "--name", "a", "--digest-only")


@pytest.fixture
def path(here, golden):
    """A digest-only golden of the policy of mine.py."""
    assert golden(*ADD).code == 0
    return here / "recordings" / "golden" / "a.digest"


def test_it_is_one_small_file_that_says_what_was_run(path, golden, monkeypatch):
    assert [one.name for one in path.parent.iterdir()] == ["a.digest"]
    assert path.stat().st_size < 5000
    kept = read_digest(path)
    command_line.call(monkeypatch, "run", "quick", "--policy", "mine:Policy", "--steps", 8, "--record", "a.mcap")
    log = open_log(path.parent.parent.parent / "a.mcap")
    assert (kept.digest, len(kept.steps)) == (log.digest, len(log))
    assert kept.header.policy_digest == log.header.policy_digest
    assert kept.header.attachments["scenario.yaml"] == log.header.attachments["scenario.yaml"]
    assert "steps      8 of at most 8, still burning" in kept.facts
    assert golden("check").code == 0


def test_the_same_run_gives_the_same_file(path, golden):
    assert golden(*ADD[:-1], "--digest-only", "--dir", "two").code == 0
    assert (path.parents[2] / "two" / "a.digest").read_bytes() == path.read_bytes()


def test_a_changed_policy_is_named_with_the_brigade_and_what_it_chose(path, golden, change_policy):
    change_policy("EASIEST")
    done = golden("check", "--keep", "new")
    assert done.code == 1
    assert "a: policy changed; step 1, choose: brigade 0 chose easiest, was nearest-to-me\n" in done.out
    assert "changed: policy: mine:Policy, digest " in done.out
    assert "  return: " in done.out
    new = path.parents[2] / "new"
    assert {one.name for one in new.iterdir()} == {"a.mcap", "a.html", "a.png"}
    assert len(open_log(new / "a.mcap")) == 9


def test_the_step_in_which_it_begins_to_differ(path, golden, write_policy):
    line = "        return Decision(Action.NEAREST_TO_ME)"
    count = "        self.n = getattr(self, 'n', 0) + 1\n"
    sixth = "        return Decision(Action.EASIEST if self.n == 6 else Action.NEAREST_TO_ME)"
    write_policy(POLICY.replace(line, count + sixth))
    done = golden("check")
    assert done.code == 1
    assert "; step 3, choose: brigade 1 chose easiest, was nearest-to-me" in done.out
    first = json.loads(golden("check", "--json").out)[0]["first"]
    assert (first["step"], first["topic"], first["index"], first["a"], first["b"]) == (3, "/decisions", 1, 3, 0)


def test_what_differs_but_is_not_kept_is_named_by_its_topic(path, golden):
    kept = json.loads(path.read_text())
    codes = kept["steps"][5]
    kept["digest"] = "0" * 64
    kept["steps"][5] = codes[:8] + "__" + codes[10:]
    path.write_text(json.dumps(kept))
    done = golden("check")
    assert done.code == 1
    assert "nothing recorded changed; step 5, fire: buildings are not the same\n" in done.out
    kept["steps"][5] = codes
    path.write_text(json.dumps(kept))
    assert "the digest is another one, and no step is" in golden("check").out


def test_a_changed_simulator_is_named(path, golden):
    kept = json.loads(path.read_text())
    kept["digest"], kept["run"]["simulator_digest"] = "0" * 64, "1" * 64
    kept["steps"][2] = "_" + kept["steps"][2][1:]
    path.write_text(json.dumps(kept))
    assert "a: simulator changed; step 2, draw: draws are not the same" in golden("check").out


def test_fewer_steps(path, golden):
    kept = json.loads(path.read_text())
    kept["digest"], kept["steps"] = "0" * 64, kept["steps"][:5]
    kept["run"]["n_steps_max"] = 4
    path.write_text(json.dumps(kept))
    assert "steps changed; 9 steps, was 5; all that both have are the same" in golden("check").out


def test_a_changed_scenario_is_named_key_by_key(here, golden, monkeypatch):
    scenario = command_line.call(monkeypatch, "scenarios", "show", "quick", "--yaml").out
    (here / "own.yaml").write_text(scenario)
    golden("add", "own.yaml", "--policy", "random", "--steps", 4, "--digest-only", "--name", "own")
    (here / "own.yaml").write_text(scenario.replace("power_litres: 2000", "power_litres: 1000"))
    done = golden("check")
    assert "changed: scenario: parameters.brigades.power_litres: 1000, was 2000; policy" in done.out
    (here / "own.yaml").write_text(scenario.replace("  n: 4\n", "  n: 3\n"))
    done = golden("check", "--keep", "new")
    assert "own: scenario changed; city: it is another one" in done.out
    assert (here / "new" / "own.html").is_file()


def test_update_renews_it(path, golden, change_policy):
    before = path.read_bytes()
    assert golden("update", "--reason", "None.").out == "0 changed, 1 the same\n"
    assert path.read_bytes() == before
    change_policy("EASIEST")
    assert golden("update", "--reason", "Easy.").code == 0
    assert path.read_bytes() != before
    assert golden("check").code == 0
    assert sorted(one.name for one in path.parent.iterdir()) == ["REASONS.md", "a.digest"]


def test_list_and_remove(path, golden):
    golden("add", "quick", "--policy", "easiest", "--steps", 4)
    goldens = json.loads(golden("list", "--json").out)["goldens"]
    assert [(one["name"], one["kind"], one["n_steps"]) for one in goldens] == [
        ("a", "digest", 8),
        ("quick-easiest", "recording", 4),
    ]
    assert golden("list", "--dir", path.parent).out == golden("list", path.parent).out == golden("list").out
    assert golden("remove", "a").out == "removed recordings/golden/a.digest\n"
    assert not path.exists()


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda kept: kept.pop("steps"), "a.digest: Object missing required field `steps`"),
        (lambda kept: kept.update(more=1), "a.digest: Object contains unknown field `more`"),
        (lambda kept: kept.update(format="x"), "a.digest: Invalid enum value 'x'"),
        (lambda kept: kept["run"].update(seed="one"), "run: Expected `int`, got `str`"),
    ],
)
def test_a_file_that_is_none(path, golden, change, complaint):
    kept = json.loads(path.read_text())
    change(kept)
    path.write_text(json.dumps(kept))
    done = golden("check")
    assert done.code == 2
    assert complaint in done.out
    assert complaint in golden("list").out
    with pytest.raises(LogError):
        read_digest(path)


def test_merge_marks_and_other_bytes(path, golden):
    path.write_bytes(b"<<<<<<< HEAD\n" + path.read_bytes())
    assert "a: recordings/golden/a.digest: JSON is malformed" in golden("check").out
    path.write_bytes(b"\xff")
    assert golden("check").code == 2


def test_a_name_is_taken_by_either_kind(path, golden):
    for words in (ADD, ADD[:-1]):
        done = golden(*words)
        assert done.code == 2
        assert "a.digest: expected a name that is free" in done.err
    path.with_suffix(".mcap").write_bytes(b"")
    done = golden("check")
    assert (done.code, done.out) == (2, "")
    assert "a: expected a recording or a digest, got both, a.mcap and a.digest" in done.err


def test_a_training_has_none(here, golden):
    done = golden("add", "quick", "--train", "--digest-only")
    assert done.code == 2
    assert "--digest-only is for a run" in done.err


def test_a_large_recording_is_worth_a_word(here, golden, monkeypatch):
    monkeypatch.setattr("fireworld.recording.golden.store.LARGE_BYTES", 1000)
    done = golden(*ADD[:-1])
    assert done.err.count("keep its digest only, or use Git LFS") == 1
