"""The conformance tests of PettingZoo and Gymnasium."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Iterator
from functools import partial
from types import SimpleNamespace
from typing import Any

import gymnasium
from gymnasium.utils.env_checker import check_env
from pettingzoo import test

from fireworld import envs
from fireworld.envs.check.checks import Check
from fireworld.envs.setup import Scenarios
from fireworld.envs.views import OBSERVATIONS

_CYCLES = 200


def checks_of_libraries(scenario: Scenarios, *, benchmark: bool) -> Iterator[Check]:
    """Yield the tests of both libraries, for every kind of observation.

    Args:
        scenario: what is played.
        benchmark: PettingZoo's measurement too, which takes five seconds.
    """
    for kind in OBSERVATIONS:
        team, turns = partial(envs.team, scenario, observation=kind), partial(envs.turns, scenario, observation=kind)
        yield Check(f"parallel_api_test, {kind}", "team", partial(_parallel_api, team))
        yield Check(f"parallel_seed_test, {kind}", "team", partial(test.parallel_seed_test, team))
        yield Check(f"api_test, {kind}", "turns", partial(_api, turns))
        yield Check(f"seed_test, {kind}", "turns", partial(test.seed_test, turns))
        yield Check(f"state_test, {kind}", "turns", partial(_state, turns, team))
        for form, name in (("brigade", "fireworld/Brigade-v0"), ("whole team", "fireworld/Team-v0")):
            yield Check(f"check_env, {kind}", form, partial(_check_env, name, scenario, kind))
    own_team = partial(envs.team, scenario, observation="graph", own_targets=8)
    own_turns = partial(envs.turns, scenario, observation="graph", own_targets=8)
    yield Check("parallel_api_test, own targets", "team", partial(_parallel_api, own_team))
    yield Check("api_test, own targets", "turns", partial(_api, own_turns))
    yield Check("max_cycles_test", "turns", partial(_max_cycles, scenario))
    if benchmark:
        yield Check("performance_benchmark", "turns", partial(_benchmark, scenario))


def _parallel_api(make: Any) -> None:
    test.parallel_api_test(make(), num_cycles=_CYCLES)


def _api(make: Any) -> None:
    test.api_test(make(), num_cycles=_CYCLES)


def _state(make_turns: Any, make_team: Any) -> None:
    test.state_test(make_turns(), make_team())


def _max_cycles(scenario: Scenarios) -> None:
    """The library's `max_cycles` is the last step."""
    test.max_cycles_test(
        SimpleNamespace(
            parallel_env=lambda max_cycles: envs.team(scenario, steps=max_cycles),
            env=lambda max_cycles: envs.turns(scenario, steps=max_cycles),
        )
    )


def _check_env(name: str, scenario: Scenarios, kind: str) -> None:
    """The live view needs a display; pictures are checked here."""
    made = gymnasium.make(name, scenario=scenario, observation=kind, render_mode="rgb_array").unwrapped
    made.spec = None  # with it, every mode would be tried
    check_env(made)
    made.close()
    check_env(gymnasium.make(name, scenario=scenario, observation=kind).unwrapped, skip_render_check=True)


def _benchmark(scenario: Scenarios) -> str:
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        test.performance_benchmark(envs.turns(scenario))
    turns = re.search(r"([\d.]+) turns per second", said.getvalue())
    return f"{float(turns[1]):,.0f} turns a second" if turns else ""
