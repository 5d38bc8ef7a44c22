"""Snapshots, forks and copies of every form lead to what would have come, to the last bit."""

from __future__ import annotations

import copy
from typing import Any

from fireworld.envs.check.players import PLAYERS, Player, exact, play, randomly
from fireworld.envs.setup import Scenarios
from fireworld.envs.snapshots import pack
from fireworld.errors import LogError

_BEFORE, _AFTER = 13, 30


def check_snapshots(form: str, scenario: Scenarios, **options: Any) -> None:
    """Raise AssertionError unless a snapshot leads, here and elsewhere, to what came after it."""
    player, env, wanted, snapshot = _played(form, scenario, options)
    seen = exact(env.restore(snapshot))
    assert _after(player, env) == wanted, "restored, it goes another way"
    other = player.make(scenario, seed=99, **options)
    assert exact(other.restore(snapshot)) == seen, "restored elsewhere, it sees something else"
    assert _after(player, other) == wanted, "restored elsewhere, it goes another way"
    for foreign in (b"", b"nothing", snapshot[:-99], pack("fireworld-other/1", {}, {})):
        before = other.digest()
        try:
            other.restore(foreign)
        except LogError:
            assert other.digest() == before, "a foreign snapshot changes it"
        else:
            raise AssertionError("a foreign snapshot is restored")


def check_copies(form: str, scenario: Scenarios, **options: Any) -> None:
    """Raise AssertionError unless a copy goes its own way, and that the same."""
    player, env, wanted, snapshot = _played(form, scenario, options)
    env.restore(snapshot)
    before, other = env.digest(), copy.deepcopy(env)
    assert other.digest() == before, "a copy is in another state"
    assert _after(player, other) == wanted, "a copy goes another way"
    other.close()
    assert env.digest() == before, "a copy changes what it is of"
    assert _after(player, env) == wanted, "it goes another way after it was copied"


def check_forks(form: str, scenario: Scenarios, **options: Any) -> None:
    """Raise AssertionError unless forks do the same with the same random draws, and something else with others."""
    player, env, wanted, snapshot = _played(form, scenario, options)
    env.restore(snapshot)
    if form in {"worlds", "vector"}:
        env.fork(0, 1)
        state = env if form == "worlds" else env.worlds
        assert state.world(0).digest() == state.world(1).digest(), "a fork is in another state"
        env.fork(0, 1, seed=7)
        assert state.world(1).seed == 7, "a fork has no draws of its own"
        return
    same, other = env.fork(), env.fork(seed=7)
    assert same.digest() == env.digest() != other.digest(), "a fork is in another state"
    assert _after(player, same) == wanted, "a fork goes another way"
    assert other.worlds.world(0).seed == 7, "a fork has no draws of its own"


def check_seeds(form: str, scenario: Scenarios, **options: Any) -> str:
    """Raise AssertionError if two episodes have the same seed, or a base leads to other episodes the second time."""
    player, found = PLAYERS[form], []
    for worker in range(3):
        more = {"first_worker": 3 * worker} if form == "worlds" else {"worker": 3 * worker}
        env = player.make(scenario, seed=5, **more, **options)
        for _ in range(4):
            player.begin(env)
            found += _seeds(env)
        once = found[-1]
        env.reset(seed=5)
        first = _seeds(env)
        env.reset(seed=5)
        assert _seeds(env) == first, "a reset with a seed does not repeat it"
        assert once not in first, "a reset with a seed does not begin with episode 0"
    assert len(set(found)) == len(found), "two episodes have the same seed"
    return f"{len(found)} episodes"


def _seeds(env: Any) -> list[int]:
    worlds = getattr(env, "worlds", env)
    found: list[int] = worlds.info()["seed"].tolist()
    return found


def _played(form: str, scenario: Scenarios, options: dict[str, Any]) -> tuple[Player, Any, Any, bytes]:
    """Return a player, an environment that has been played, what came after some steps, and the snapshot there."""
    player = PLAYERS[form]
    env = player.make(scenario, seed=3, **options)
    player.begin(env)
    play(player, env, _BEFORE, randomly(1))
    snapshot: bytes = env.snapshot()
    return player, env, _after(player, env), snapshot


def _after(player: Player, env: Any) -> Any:
    return exact(play(player, env, _AFTER, randomly(2)))
