"""The fault campaign: a slice of every kind; and what is planted to fail is counted."""

from __future__ import annotations

import dataclasses
import mmap
import os
import random
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest

from tests.docs.pages import ROOT
from tests.faults import campaign, material, misbehaving, mounts
from tests.faults.bench import Bench
from tests.faults.calls import crowd, forked, process
from tests.faults.damaged import MAKERS
from tests.faults.kinds import KINDS
from tests.faults.ledger import Ledger
from tests.faults.outcomes import Done, Outcome, judge
from tests.faults.writers import WRITERS, Whole, look

GOOD = Done(("run",), 0, "", "", 0.5, 300_000_000)
LINE = "fireworld: a.mcap: expected a recording, got nothing; try another\n"


@pytest.mark.heavy
def test_a_slice_of_every_kind(tmp_path):
    words = ("--cases", "2", "--seconds", "120", "--light", "--reports", str(tmp_path))
    done = subprocess.run(
        [sys.executable, "-m", "tests.faults.campaign", *words], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    counts = {line.split()[0]: line.split()[1] for line in done.stdout.splitlines() if line}
    assert counts | dict.fromkeys(KINDS, "2") == counts
    assert counts["all"] == str(2 * len(KINDS))


@pytest.mark.parametrize(
    ("changes", "kinds"),
    [
        ({}, []),
        ({"code": 2, "err": LINE}, []),
        ({"code": 2, "err": ""}, ["line"]),
        ({"code": 2, "err": LINE * 2}, ["line"]),
        ({"code": 2, "err": LINE.replace("a.mcap", "\x1b[31m")}, ["line"]),
        ({"code": 2, "err": "fireworld: no\n"}, ["line"]),
        ({"code": 1}, ["exit code"]),
        ({"code": -11}, ["exit code"]),
        ({"code": 1, "err": "Traceback (most recent call last):\n  x\nValueError: y\n"}, ["traceback", "exit code"]),
        ({"code": 2, "err": "fireworld: internal error: ValueError: y\n"}, ["traceback"]),
        ({"peak_bytes": 1_100_000_000}, ["memory"]),
        ({"cpu_seconds": 11.0}, ["hang"]),
        ({"timed_out": True, "code": -9}, ["hang"]),
        ({"n_orphans": 1}, ["other"]),
    ],
)
def test_what_is_wrong_with_a_call(changes, kinds):
    assert [failure.kind for failure in judge(dataclasses.replace(GOOD, **changes), {0, 2})] == kinds


def burn():
    while True:
        pass


def take():
    return bytes(b"x" * 1_200_000_000)


def leave():
    if os.fork() == 0:
        time.sleep(30)
        os._exit(0)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("act", "seconds", "kinds"),
    [
        (burn, 1, ["hang"]),
        (take, 60, ["memory"]),
        (leave, 60, ["other"]),
        (lambda: 1 // 0, 60, ["traceback", "exit code"]),
    ],
)
def test_what_a_fork_does_is_seen(tmp_path, act, seconds, kinds):
    done = forked(("planted",), tmp_path, io=tmp_path, act=act, cpu_seconds_max=seconds)
    assert [failure.kind for failure in judge(done, {0}, cpu_seconds_max=seconds)] == kinds


@pytest.mark.heavy
def test_files_that_its_parent_has_mapped_hide_nothing(tmp_path):
    """They are memory of the parent, and none of a fork that does not read them."""
    n_bytes = 400_000_000
    with (tmp_path / "mapped").open("w+b") as file:
        file.truncate(n_bytes)
        with mmap.mmap(file.fileno(), n_bytes, prot=mmap.PROT_READ) as mapped:
            assert sum(mapped[:: mmap.PAGESIZE]) == 0
            done = forked(("planted",), tmp_path, io=tmp_path, act=take, cpu_seconds_max=60)
    assert [failure.kind for failure in judge(done, {0}, cpu_seconds_max=60)] == ["memory"]


@pytest.mark.heavy
@pytest.mark.parametrize("call", [forked, process])
def test_what_its_parent_holds_is_not_counted(tmp_path, call):
    held = bytes(b"x" * 1_200_000_000)
    done = call(("--version",), tmp_path, io=tmp_path)
    del held
    assert judge(done, {0}) == []


def test_a_half_file_and_a_scratch_file_are_seen(tmp_path):
    bench = Bench(tmp_path, tmp_path)
    expected = Whole({"r.html": b"<html></html>"}, 0, 3, 0.1, same=True)
    look(bench, WRITERS["report"], expected, {}, killed=False)
    (bench.folder / "r.html").write_bytes(b"<html></html>")
    look(bench, WRITERS["report"], expected, {}, killed=False)
    assert bench.outcome.failures == []
    (bench.folder / "r.html").write_bytes(b"<html>")
    (bench.folder / ".fireworld-1").mkdir()
    (bench.folder / ".fireworld-1" / "r.html").write_bytes(b"<")
    (bench.folder / "r.html.tmp").write_bytes(b"<")
    look(bench, WRITERS["report"], expected, {}, killed=False)
    assert [failure.kind for failure in bench.outcome.failures] == ["other", "half file", "other"]


def planted(tmp_path, *, fails=(), n_inputs=1):
    """A kind whose cases are noted in a file, and some of which fail."""

    def run(generator, bench):
        with (tmp_path / "tried").open("a") as file:
            file.write("x")
        number = (tmp_path / "tried").stat().st_size
        act = (lambda: 1 // 0) if number in fails else (lambda: None)
        bench.call(("planted", number), codes={0}, act=act)
        bench.outcome.n_inputs = n_inputs
        return bench.outcome

    return SimpleNamespace(NAME="planted", SHARE=1.0, run=run)


@pytest.fixture
def small(tmp_path, monkeypatch):
    """Run a campaign of planted cases; return its exit code."""
    monkeypatch.setattr(material, "warm", lambda: None)
    monkeypatch.setattr(material, "make", lambda folder: folder.mkdir())

    def run(*words, **how):
        monkeypatch.setitem(campaign.KINDS, "planted", planted(tmp_path, **how))
        given = ("--only", "planted", "--jobs", "1", "--reports", str(tmp_path / "reports"), *words)
        return campaign.main(given)

    return run


@pytest.mark.heavy
def test_a_failure_is_counted_and_can_be_repeated(small, capsys):
    assert small("--cases", "3", fails={2}) == 1
    out = capsys.readouterr().out
    assert out.splitlines()[1].split()[:2] == ["planted", "3"]
    assert "planted:1000001: python -m tests.faults.campaign --case 'planted:1000001'" in out
    assert "traceback: `planted 2`: Traceback (most recent call last): / " in out
    assert small("--case", "planted:1000001") == 0
    assert "planted:1000001: good" in capsys.readouterr().out


@pytest.mark.heavy
def test_a_second_call_goes_on_and_tries_again_what_failed(small, tmp_path, capsys):
    assert small("--cases", "3", fails={1}) == 1
    assert small("--cases", "5", "--resume") == 0
    assert (tmp_path / "tried").stat().st_size == 3 + 1 + 2
    assert capsys.readouterr().out.splitlines()[-1].split()[:2] == ["all", "5"]
    assert small("--cases", "2") == 0, "without --resume it begins anew"
    assert (tmp_path / "tried").stat().st_size == 6 + 2


@pytest.mark.heavy
def test_ctrl_c_prints_the_table(small, monkeypatch, capsys):
    def interrupted(_, ledger, *__):
        ledger.add("planted:1000000", Outcome(), 0.5)
        raise KeyboardInterrupt

    monkeypatch.setattr(campaign, "_campaign", interrupted)
    assert small() == 0
    assert capsys.readouterr().out.splitlines()[-1].split()[:2] == ["all", "1"]


def test_what_other_code_did_is_not_gone_on_with(tmp_path, monkeypatch):
    ledger = Ledger.begin(tmp_path / "a.jsonl", resume=True)
    ledger.add("kills:1", Outcome(), 1.0)
    with ledger.path.open("a") as file:
        file.write('{"case": "kills:2", "outc')
    assert list(Ledger.begin(ledger.path, resume=True).outcomes) == ["kills:1"]
    monkeypatch.setattr("tests.faults.ledger.digest_of_sources", lambda: "other")
    assert Ledger.begin(ledger.path, resume=True).outcomes == {}


def test_cases_are_drawn_from_their_names_alone():
    first, second = (random.Random("kills:1000017").random() for _ in range(2))
    assert first == second != random.Random("kills:1000018").random()


def test_every_kind_has_its_share_and_many_ways():
    assert 0.99 < sum(kind.SHARE for kind in KINDS.values()) < 1.2
    assert len(misbehaving.POLICIES) > 100
    assert len(WRITERS) > 25
    assert len(set(MAKERS)) > 8


@pytest.mark.heavy
def test_a_crowd_works_at_once(tmp_path):
    began = time.monotonic()
    (tmp_path / "io").mkdir()
    done = crowd([("--version",)] * 3, tmp_path, io=tmp_path / "io", cpu_seconds_max=10)
    assert [one.code for one in done] == [0, 0, 0]
    assert time.monotonic() - began < 60


@pytest.mark.skipif(sys.platform != "linux" or os.geteuid() != 0, reason="not root, so there are no small disks")
def test_a_small_disk_is_full(tmp_path):
    code = (
        "from pathlib import Path; from tests.faults import mounts; p = Path('%s')\n"
        "if mounts.can_mount():\n"
        "    with mounts.small_disk(p, 8192) as again:\n"
        "        try: (p / 'a').write_bytes(bytes(100_000))\n"
        "        except OSError as error: print(error.errno)\n"
        "        again('size=1m'); (p / 'a').write_bytes(bytes(100_000))\n"
        "else: print(28)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code % tmp_path], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.stdout, done.stderr) == ("28\n", "")
    assert mounts.SMALLEST_BYTES == 4096
