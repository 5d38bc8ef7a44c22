"""Two logs of what learners played, compared episode by episode: those of one world, of one number, with each other."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from itertools import islice
from typing import Any, Final

import numpy as np
from fireworld_recorder.codec import encode

from fireworld.executors import Workers
from fireworld.records import ACTION_NAMES
from fireworld.scenario import Scenario
from fireworld.training.log.environment import Environment, PlayedTrainer
from fireworld.training.log.first_difference import FirstDifference, Trained
from fireworld.training.log.played import OWN, Decided, Played
from fireworld.training.log.played_run import play_again
from fireworld.training.log.reader import Part, TrainingLog, without_columns
from fireworld.training.log.records import TrainingHeader
from fireworld.training.log.spread import ScenarioDifference, Spread
from fireworld.training.seeds import Seeds

DRAWN: Final = ("scenario", "base", "seed", "seed_given", "first_step", "state", "later_step", "later_seed")
"""What an episode begins with."""
AT_ONCE: Final = 64
"""Episodes that are read before they are played again, side by side."""
Key = tuple[int, int, int]
"""Of an episode: its number, its world, and which of several forks it is."""


class PlayedAgain:
    """What a learner played as this fireworld computes it, a `Trained`; episodes in unknown states stay as they are.

    Args:
        log: what was played.
        workers: who plays.
    """

    def __init__(self, log: TrainingLog, workers: Workers) -> None:
        self._log, self._workers = log, workers
        self.header: TrainingHeader = log.header
        self.method: Environment = log.player.method
        self.scenarios: list[Scenario] = log.scenarios

    def trainer(self) -> PlayedTrainer:
        """Return what goes through the episodes."""
        return self._log.player

    def parts(self) -> Iterator[Part]:
        """Play every episode again, and yield it."""
        numbers = iter(range(len(self._log)))
        while block := [*islice(numbers, AT_ONCE)]:
            found = self._workers.run([partial(self.played, number) for number in block])
            assert found is not None  # noqa: S101 - nobody stops these workers
            yield from ({Played: one} for one in found)

    def played(self, number: int) -> Played:
        """Return an episode as it is computed now, with the seed that follows from its base."""
        episode = self._log.played_at(number)
        record = episode.record
        again = play_again(episode) if record.replayable else record
        if record.seed_given:
            return again
        seed = Seeds(record.base, test=self.method.test_seeds).seed(record.world, record.episode)
        return again if seed == record.seed else replace(again, seed=seed)


@dataclass
class _Seen:
    """The episodes of a log: where each is, and a digest of it."""

    parts: dict[Key, int]
    digests: dict[Key, bytes]
    lines: dict[Key, Part]


def compare_played(
    a: TrainingLog, b: Trained, on_part: Callable[[], object]
) -> tuple[int, FirstDifference | None, list[ScenarioDifference]]:
    """Compare what was played; return how many episodes were compared, where they first differ, and how that spread.

    The first is that of the lowest number, and of these the one that differs in the earliest step.
    """
    one, other = _seen(a, on_part), _seen(b, lambda: None)
    keys = sorted({*one.parts, *other.parts})
    spread, differing, counts = Spread(), [], Counter[int]()
    for key in keys:
        same = one.digests.get(key) == other.digests.get(key)
        lines = one.lines.get(key), other.lines.get(key)
        scenario = next(line[Played].scenario for line in lines if line is not None)
        spread.add(*lines, same=same, number=counts[scenario])
        counts[scenario] += 1
        if not same:
            differing.append(key)
    first = _first(a, b, (one, other), differing)
    return len(keys), first, spread.scenarios([scenario.name for scenario in a.scenarios])


def _seen(of: Trained, on_part: Callable[[], object]) -> _Seen:
    """Go through what was played once."""
    seen, counts = _Seen({}, {}, {}), Counter[tuple[int, int]]()
    for number, part in enumerate(of.parts()):
        played: Played = part[Played]
        place = played.episode, played.world
        key = (*place, counts[place])
        counts[place] += 1
        seen.parts[key], seen.digests[key] = number, hashlib.sha256(encode(played)).digest()
        seen.lines[key] = {Played: without_columns(played)}
        on_part()
    return seen


def _first(a: TrainingLog, b: Trained, seen: tuple[_Seen, _Seen], differing: list[Key]) -> FirstDifference | None:
    """Return the first difference."""
    if not differing:
        return None
    found = []
    for key in differing:
        if key[0] > differing[0][0]:
            break
        numbers = [one.parts.get(key) for one in seen]
        if None in numbers:
            found.append(_only_one(a if numbers[0] is not None else b, seen, key))
        else:
            found.append(_difference(a, key, numbers[0] or 0, (_played(a, numbers[0]), _played(b, numbers[1]))))
    return min(found, key=lambda one: (one.step is None, one.step or 0, one.world or 0))


def _played(of: Trained, number: int | None) -> Played:
    """Return one episode."""
    if isinstance(of, PlayedAgain):
        return of.played(number or 0)
    assert isinstance(of, TrainingLog)  # noqa: S101 - there is nothing else of the kind
    part = next(of.parts(number or 0))
    played: Played = part[Played]
    return played


def _only_one(of: Trained, seen: tuple[_Seen, _Seen], key: Key) -> FirstDifference:
    """Describe an episode that one side has alone."""
    in_a = key in seen[0].parts
    side = seen[0] if in_a else seen[1]
    words = ("is there", "is not") if in_a else ("is not", "is there")
    return _place(of, key, side.parts[key], side.lines[key][Played], phase="end", what="", a=words[0], b=words[1])


def _difference(a: TrainingLog, key: Key, number: int, pair: tuple[Played, Played]) -> FirstDifference:
    """Describe how two episodes differ that are of one world and of one number."""
    one, other = pair
    for name in DRAWN:
        x, y = getattr(one, name), getattr(other, name)
        if not np.array_equal(x, y):
            return _place(a, key, number, one, phase="draw", what=name.replace("_", " "), a=_text(x), b=_text(y))
    n_brigades = a.scenarios[one.scenario].brigades.n
    before = one.first_step if one.state else 0
    found = _of_choice(one.decided(n_brigades), other.decided(n_brigades), before)
    if found is None:
        names = [item.name for item in fields(Played) if not np.array_equal(*(getattr(x, item.name) for x in pair))]
        name = next(name for name in ("n_steps", *names) if name in names)
        x, y = (getattr(played, name) for played in pair)
        found = {"phase": "end", "what": name.replace("_", " "), "a": _text(x), "b": _text(y)}
    return _place(a, key, number, one, **found)


def _of_choice(one: Decided, other: Decided, before: int) -> dict[str, Any] | None:
    """Return the first step and brigade in which what was done differs."""
    n = min(len(one.action), len(other.action))
    differ = (one.action[:n] != other.action[:n]) | (one.target[:n] != other.target[:n])
    places = np.argwhere(differ)
    if not len(places):
        return None
    row, brigade = places[0].tolist()
    words = [_choice(decided, row, brigade) for decided in (one, other)]
    return {
        "step": before + row + 1,
        "phase": "choose",
        "brigade": brigade,
        "what": "",
        "a": words[0],
        "b": words[1],
    }


def _choice(decided: Decided, row: int, brigade: int) -> str:
    action = int(decided.action[row, brigade])
    if action < 0:
        return "nothing to choose"
    named = f" building {decided.target[row, brigade]}" if action == OWN else ""
    return f"{ACTION_NAMES[action]}{named}"


def _place(of: Trained, key: Key, number: int, played: Played, **what: Any) -> FirstDifference:
    """Return a difference of an episode."""
    values: Mapping[str, Any] = {"step": None, "brigade": None, "state": None, **what}
    name = of.scenarios[played.scenario].name
    return FirstDifference(part=number, scenario=name, number=key[0], world=key[1], **values)


def _text(value: Any) -> str:
    if isinstance(value, bytes):
        return value.hex()[:12] or "none"
    return f"{value:.12g}" if isinstance(value, float) else str(value)
