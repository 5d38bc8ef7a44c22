"""What tests send to workers: tasks, a policy, executors that are made."""

from __future__ import annotations

import os
import signal
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from fireworld.executors import self_test


def square(k):
    return k * k


def nap(seconds):
    time.sleep(seconds)
    return seconds


def die_once(path, k):
    """Kill the worker, but not where it has happened before."""
    try:
        Path(path).touch(exist_ok=False)
    except FileExistsError:
        return k
    os.kill(os.getpid(), signal.SIGKILL)
    return -1


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def compute_otherwise():
    self_test.self_test = lambda: "another"


def make_executor(n):
    return ProcessPoolExecutor(n, mp_context=get_context("spawn"))


def make_odd(n):
    return ProcessPoolExecutor(n, mp_context=get_context("spawn"), initializer=compute_otherwise)


def make_nothing(n):
    return n


def make_trouble(n):
    raise ZeroDivisionError("of no use")
