"""Executors for work that comes in many parts: threads, processes, a cluster, or one's own, with the same results."""

from fireworld.executors.choosing import AnyExecutor, On, in_this_process, workers_for
from fireworld.executors.workers import ExecutorError, Unfinished, Workers, given, n_cores, processes, threads

__all__ = [
    "AnyExecutor",
    "ExecutorError",
    "On",
    "Unfinished",
    "Workers",
    "given",
    "in_this_process",
    "n_cores",
    "processes",
    "threads",
    "workers_for",
]
