"""Work elsewhere: the same bytes, whoever dies; what travels; who is refused; stops."""

from __future__ import annotations

import importlib.util
import json
import time
from functools import partial
from threading import Event

import pytest

import fireworld as fw
from fireworld.executors import ExecutorError, On, in_this_process, packing, sending, workers_for
from fireworld.executors.packing import Packer
from fireworld.interrupt import Interrupted
from fireworld.policy.kernel import always
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from tests.executors import far

pytestmark = pytest.mark.slow
HAS_DASK = importlib.util.find_spec("distributed") is not None
dask = pytest.param("dask", marks=pytest.mark.skipif(not HAS_DASK, reason="dask is not installed"))
MINE = """
from helps import ACTION
from fireworld import Decision

class Mine:
    def decide(self, observation):
        return Decision(ACTION)
"""


def on(word, n=2):
    return On(word, n)


@pytest.fixture
def mine(tmp_path):
    (tmp_path / "mine_far.py").write_text(MINE)
    (tmp_path / "helps.py").write_text("ACTION = 2\n")
    return f"{tmp_path / 'mine_far.py'}:Mine"


@pytest.mark.parametrize("word", ["processes", dask, "tests.executors.far:make_executor"])
def test_a_comparison_has_the_same_bytes(word, mine):
    def text(executor):
        found = fw.compare(["chief", "best", mine], scenarios=["quick"], seeds=6, executor=executor)
        return json.dumps(found.to_dict())

    assert text(on(word)) == text(1)


@pytest.mark.parametrize("word", ["processes", dask])
def test_a_killed_worker_changes_nothing(word, tmp_path):
    tasks = [partial(far.die_once, str(tmp_path / f"died-{k}"), k) for k in range(24)]
    for k in range(24):
        if k % 12 != 5:
            tasks[k] = partial(far.square, k)
    told = []
    found = workers_for(on(word)).run(tasks, lambda number, _: told.append(number))
    assert found == [k if k % 12 == 5 else k * k for k in range(24)]
    assert sorted(told) == [*range(24)], "each once"
    assert len([*tmp_path.iterdir()]) == 2, "two workers died"


def test_work_that_kills_again_and_again_takes_one_line():
    with pytest.raises(ExecutorError, match="processes: a process that did a part of the work died, again") as caught:
        workers_for(on("processes", 1)).run([partial(far.square, 2), far.die])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("word", ["processes", dask])
def test_a_stop_waits_a_second_and_keeps_what_is_done(word):
    workers, told = workers_for(on(word), stop=Event()), []

    def note(number, _):
        told.append((number, time.monotonic()))
        workers.stop.set()

    assert workers.run([partial(far.square, 3), partial(far.nap, 60)], note) is None
    ((number, since),) = told
    assert number == 0
    assert time.monotonic() - since < 4, "a second, and what it takes to end the workers on a busy machine"


def test_an_interrupted_comparison_keeps_its_runs(tmp_path):
    stop, path = Event(), tmp_path / "runs.parquet"
    pytest.importorskip("pyarrow")
    words = {"scenarios": "quick", "seeds": 60, "results": path, "executor": on("processes")}
    with pytest.raises(Interrupted, match="they are kept in"):
        fw.compare(["chief", "random"], stop=stop, on_run=lambda n, _: n and stop.set(), **words)
    known = []
    fw.compare(["chief", "random"], on_run=lambda n, _: known.append(n), **words)
    assert 0 < known[0] < 120


def test_a_worker_that_computes_otherwise_is_refused():
    with pytest.raises(
        ExecutorError, match=r"worker process \d+ on .*: expected a self-test with the digest"
    ) as caught:
        workers_for(on("tests.executors.far:make_odd", 1)).run([partial(far.square, 2)])
    assert "numba" in str(caught.value)


def test_another_version_is_refused(monkeypatch):
    monkeypatch.setattr(sending, "simulator_version", lambda: "9.9.9")
    with pytest.raises(ExecutorError, match=r"worker process .*: expected fireworld 9.9.9, as here, got '0\."):
        workers_for(on("processes", 1)).run([partial(far.square, 2)])


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("no_such_module:make", "--on: no_such_module:make: no_such_module cannot be imported"),
        ("tests.executors.far:make_no", "expected a function of the number of workers"),
        ("tests.executors.far:make_trouble", "far:make_trouble: failed: ZeroDivisionError: of no use"),
        ("tests.executors.far:make_nothing", "expected an executor of concurrent.futures, got 2"),
    ],
)
def test_mistakes_of_ones_own_take_one_line(word, message):
    with pytest.raises(ExecutorError, match=message):
        workers_for(on(word)).run([partial(far.square, 2)])


def test_dask_that_is_missing_takes_one_line(monkeypatch):
    from fireworld.executors import on_dask

    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(on_dask, "import_module", missing)
    with pytest.raises(ExecutorError, match=r"dask is not installed; try pip install 'fireworld\[dask\]'"):
        workers_for("dask")


def test_no_city_travels():
    built, policy = build_scenario(load_scenario("test-1")), always(2)
    packer = Packer()
    packed = packer.pack([partial(far.square, (built, policy, seed)) for seed in range(50)])
    assert len(packed.content) < 50 * 50, "a few bytes a run"
    assert sum(len(packer.apart[digest]) for digest in packed.needs) < 20_000
    assert {one.name for one in packed.modules} >= {"tests.executors.far", "tests.executors", "tests"}


def test_what_cannot_travel_is_refused_with_the_reason(monkeypatch):
    monkeypatch.setattr(packing, "NOTEBOOK", far.__name__)
    with pytest.raises(ExecutorError, match="square, which the script or notebook that runs defines; move it"):
        Packer().pack([partial(far.square, 1)])
    with pytest.raises(ExecutorError, match="expected work that can be sent to other processes"):
        Packer().pack([lambda: 1])


def test_where_words_work():
    assert in_this_process(On("threads", 3))
    assert workers_for(On("threads", 3)).n == 3
    assert not any(map(in_this_process, ("dask", "processes", "my:own", On("dask://a:1"))))
