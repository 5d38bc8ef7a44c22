"""All that `python -m fireworld.envs.check` checks; and that it would notice."""

from __future__ import annotations

import json
import runpy
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from pkgutil import resolve_name

import numpy as np
import pytest

import fireworld as fw
from tests.envs.extra import MISSING, needs_extra
from tests.envs.towns import HOT, LATER, SMALL, deadly, pickled

pytestmark = needs_extra()

if not MISSING:
    import gymnasium

    from fireworld import envs
    from fireworld.envs.check import everything
    from fireworld.envs.check.checks import COLUMNS, Check, Checked, run_check, table_of
    from fireworld.envs.check.everything import checks_of
    from fireworld.envs.check.logs import follow
    from fireworld.envs.check.players import PLAYERS, exact, play, randomly
    from fireworld.envs.check.states import check_copies, check_forks, check_seeds, check_snapshots
    from fireworld.envs.check.vectors import compare_with_single

    CHECKS = [*checks_of("quick", benchmark=False)]
else:
    CHECKS = []


@pytest.mark.parametrize("check", CHECKS, ids=str)
def test_it_is_kept(check):
    checked = run_check(check)
    assert checked.ok, checked.detail


def test_the_table_has_eighty_columns():
    checks = [
        Check("fine", "team", lambda: "10,000 turns a second"),
        Check("wrong", "turns", lambda: 1 / 0),
        Check("odd", "vector", lambda: warnings.warn("it is odd", stacklevel=1)),
        Check("expected", "team", lambda: warnings.warn("Observation is not a NumPy array", stacklevel=1)),
        Check("long", "team", lambda: "x" * 100),
    ]
    checked = [run_check(check) for check in checks]
    assert [one.ok for one in checked] == [True, False, False, True, True]
    table = table_of(checked)
    lines = table.splitlines()
    assert max(map(len, lines[:7])) == COLUMNS == 80
    assert lines[-3:] == [
        "3 of 5 checks are passed",
        "turns: wrong: ZeroDivisionError: division by zero",
        "vector: odd: warns: it is odd",
    ]


def break_(monkeypatch, name, change):
    """Let something of a form be otherwise than it is."""
    module, _, attribute = name.rpartition(".")
    owner = resolve_name(f"fireworld.envs.{module}")
    monkeypatch.setattr(owner, attribute, change(getattr(owner, attribute)))


def one_more(original):
    """A step whose reward is higher by one."""

    def step(self, *args):
        done = original(self, *args)
        return (done[0], done[1] + 1.0, *done[2:])

    return step


BROKEN = {
    "a reward": (
        "vector_env:TeamVectorEnv.step",
        one_more,
        lambda: compare_with_single(SMALL, gymnasium.vector.AutoresetMode.NEXT_STEP, n_steps=5),
        "reward is another one",
    ),
    "what is known in the end": (
        "many_worlds:Worlds._run",
        lambda original: lambda self, run: without_info(original(self, run)),
        lambda: compare_with_single(SMALL, gymnasium.vector.AutoresetMode.SAME_STEP),
        "info is another one",
    ),
    "a state that is forgotten": (
        "bound_worlds:BoundWorlds.take",
        lambda original: lambda self, held: original(self, {**held, "clock": held["clock"] * 0}),
        lambda: check_snapshots("team", SMALL),
        "restored, it goes another way|sees something else",
    ),
    "a copy that shares its worlds": (
        "many_worlds:Worlds.__deepcopy__",
        lambda _: lambda self, _: self,
        lambda: check_copies("whole team", SMALL),
        "a copy changes what it is of|goes another way",
    ),
    "a fork with other draws": (
        "bound_worlds:BoundWorlds.draw_anew",
        lambda _: lambda *_: None,
        lambda: check_forks("brigade", SMALL),
        "another state",
    ),
    "seeds that repeat": (
        "many_worlds:Seeds.seed",
        lambda _: lambda *given: given[-1],
        lambda: check_seeds("vector", SMALL),
        "two episodes have the same seed|does not begin",
    ),
}


def without_info(stepped):
    return replace(stepped, final_info=stepped.info if stepped.final_info is not None else None)


@pytest.mark.parametrize("name", BROKEN)
def test_checks_notice(name, monkeypatch):
    where, change, check, message = BROKEN[name]
    module, _, attribute = where.partition(":")
    break_(monkeypatch, f"{module}:{attribute}", change)
    with pytest.raises(AssertionError, match=message):
        check()


def test_a_log_of_another_seed_is_not_followed():
    run = fw.run(SMALL, policy="random", seed=3)
    assert follow("turns", run) == len(run) - 1
    with pytest.raises(AssertionError, match="step 1: energy is not what is recorded"):
        follow("turns", Reseeded(run))


class Reseeded:
    """A run whose header has another seed than its steps."""

    def __init__(self, run):
        self._run = run
        self.header = replace(run.header, seed=run.header.seed + 1)

    def __getattr__(self, name):
        return getattr(self._run, name)

    def __iter__(self):
        return iter(self._run)


@pytest.mark.slow
def test_the_command():
    command = [sys.executable, "-m", "fireworld.envs.check", "--no-benchmark", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    found = json.loads(done.stdout)
    assert len(found) == len(CHECKS)
    assert all(one["ok"] and one["seconds"] >= 0 for one in found)
    table = table_of([Checked(**one) for one in found])
    assert table.endswith(f"{len(CHECKS)} of {len(CHECKS)} checks are passed")
    assert max(map(len, table.splitlines())) <= 80


def test_the_command_prints_a_table(monkeypatch, capsys):
    two = [Check("fine", "team", lambda: "10,000 turns a second"), Check("wrong", "turns", lambda: 1 / 0)]
    monkeypatch.setattr("fireworld.envs.check.everything.checks_of", lambda *_, **__: two)
    monkeypatch.setattr("sys.argv", ["check"])
    with pytest.raises(SystemExit) as exit_:
        runpy.run_path(str(Path(everything.__file__).with_name("__main__.py")))
    assert exit_.value.code == 1
    assert capsys.readouterr().out.endswith(
        "1 of 2 checks are passed\nturns: wrong: ZeroDivisionError: division by zero\n"
    )


def test_a_command_that_cannot_check():
    command = [sys.executable, "-m", "fireworld.envs.check", "--scenario", "nowhere"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("fireworld.envs.check: ")
    assert done.stderr.count("\n") == 1
    assert "expected the name of a scenario" in done.stderr


def test_observations_are_in_their_spaces_to_the_end(tmp_path):
    """In runs in which brigades die, fires are lit later on, and everything burns."""
    random = np.random.default_rng(2)
    for scenario in (deadly(tmp_path), LATER, HOT):
        for kind in ("features", "targets", "graph"):
            env = envs.WholeTeamEnv(scenario, observation=kind, own_targets=7, seed=1)
            seen, info = env.reset()
            over = False
            while not over:
                assert seen in env.observation_space
                mask = seen["action_mask"]
                actions = (random.random(mask.shape) * mask).argmax(axis=-1)
                seen, _, terminated, truncated, info = env.step(actions)
                over = terminated or truncated
            assert seen in env.observation_space
            assert info["step"] == env.worlds.world(0).step_number


@pytest.mark.parametrize("form", PLAYERS if not MISSING else [])
def test_pickles_go_the_same_way(form):
    player = PLAYERS[form]
    env = player.make(SMALL, seed=3, observation="graph", own_targets=4)
    assert exact(player.begin(pickled(env))) == exact(player.begin(env))
    for _ in range(3):
        play(player, env, 11, randomly(1))
        other = pickled(env)
        assert other.digest() == env.digest()
        assert exact(play(player, other, 30, randomly(2))) == exact(play(player, env, 30, randomly(2)))
