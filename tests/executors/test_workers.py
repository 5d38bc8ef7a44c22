"""Executors: the same results in threads, processes and an executor that is given; stops, faults, wrong arguments."""

from __future__ import annotations

import multiprocessing
import os
import signal
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from threading import Event

import pytest

from fireworld.executors import ExecutorError, Workers, given, in_this_process, processes, threads, workers_for


def square(k):
    return k * k


def die():
    os.kill(os.getpid(), signal.SIGKILL)


TASKS = [partial(square, k) for k in range(20)]


def test_a_failing_task_stops_the_others():
    workers = Workers(2, Event())

    def fail():
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        workers.run([fail, *[workers.stop.wait] * 3])
    assert workers.stop.is_set()


def test_results_come_in_order_and_none_after_a_stop():
    workers = Workers(3, Event())
    assert workers.run([lambda k=k: k * k for k in range(20)]) == [k * k for k in range(20)]
    workers.stop.set()
    assert workers.run([lambda: 1]) is None


@pytest.mark.parametrize("executor", [None, 1, 3, "threads", "processes"])
def test_results_do_not_depend_on_the_executor(executor):
    told = []
    assert workers_for(executor).run(TASKS, lambda k, result: told.append((k, result))) == [k * k for k in range(20)]
    assert sorted(told) == [(k, k * k) for k in range(20)]


def test_a_given_executor_is_used_and_left_open():
    with ThreadPoolExecutor(2) as pool:
        assert given(pool).run(TASKS) == workers_for(pool).run(TASKS) == [k * k for k in range(20)]
        assert pool.submit(square, 3).result() == 9


def test_a_process_that_dies_takes_one_line():
    with pytest.raises(ExecutorError, match="a process that did a part of the work died") as caught:
        processes(1).run([*TASKS, die, *TASKS])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("executor", [0, -1, True, 1.5, "fibres", object(), ThreadPoolExecutor])
def test_what_is_no_executor_takes_one_line(executor):
    with pytest.raises(ExecutorError, match='executor: expected "threads", "processes"'):
        workers_for(executor)


def test_where_work_is_done():
    with (
        ThreadPoolExecutor(1) as here,
        ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as there,
    ):
        assert [in_this_process(each) for each in (None, 2, "threads", here)] == [True] * 4
        assert [in_this_process(each) for each in ("processes", there)] == [False] * 2
    assert threads(3).n == 3
