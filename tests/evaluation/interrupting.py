"""Ctrl-C in the middle of a comparison."""

from __future__ import annotations

import signal

from fireworld.evaluation import comparison_runs


def interrupt_fourth_run(monkeypatch):
    """Let somebody press Ctrl-C in the fourth run; return what lets all further runs be."""
    run, seeds = comparison_runs.run_compiled, []

    def interrupted_run(built, policy, *, seed):
        seeds.append(seed)
        if len(seeds) == 4:
            signal.raise_signal(signal.SIGINT)
        return run(built, policy, seed=seed)

    monkeypatch.setattr(signal, "getsignal", lambda _: signal.default_int_handler)
    monkeypatch.setattr(comparison_runs, "run_compiled", interrupted_run)
    return lambda: monkeypatch.setattr(comparison_runs, "run_compiled", run)
