"""Where two trainings first differ: in whose step, in what a brigade saw, chose, got or learned."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, Final, Protocol

import numpy as np

from fireworld.errors import LogError, expected
from fireworld.kernels.learning import EXPLORED, GREEDY
from fireworld.policy.teams.table_words import first_state
from fireworld.records import ACTIONS, CHOICES, Array
from fireworld.scenario import Scenario
from fireworld.training.log.learned import LearnedEpisode, learned
from fireworld.training.log.reader import Part, TrainingLog
from fireworld.training.log.records import TERM_NAMES, Episode, Evolved, TrainingHeader, Tried, Updates, part_number
from fireworld.training.method import Method, Trainer
from fireworld.training.methods.sarsa import Progress, SarsaTrainer

ENTRIES_SHOWN: Final = 8
"""Entries of the tables that a first difference lists."""


class Trained(Protocol):
    """A training part by part, from a log or under way."""

    @property
    def header(self) -> TrainingHeader:
        """What identifies it."""

    @property
    def method(self) -> Method:
        """How the team learns."""

    @property
    def scenarios(self) -> list[Scenario]:
        """What it learns in, in the order of the plan."""

    def trainer(self) -> Trainer[Any, Any]:
        """Return a trainer of it, before the first part."""

    def parts(self) -> Iterator[Part]:
        """Yield its parts."""


@dataclass(frozen=True)
class FirstDifference:
    """Where two trainings first differ.

    Attributes:
        part: number of the episode or generation, counted through the training.
        scenario: its scenario; "" of a search.
        number: of the episode in its scenario, or of the generation.
        step: in the episode; None: at its end, or in a search.
        phase: draw, observe, choose, learn, reward or end; of a search draw, choose or end.
        brigade: whose; None: the team's.
        state: it was in, by the first training; None: none.
        what: differs.
        a: the value in the first training, in words.
        b: in the second.
        entries: of the tables after the episode that differ: (table, state, action, value in A, value in B); of states
            that a table takes for one the first.
        n_entries: how many there are.
        world: the world, of what a learner played; then the number is that of the episode in it.
    """

    part: int
    scenario: str
    number: int
    step: int | None
    phase: str
    brigade: int | None
    state: int | None
    what: str
    a: str
    b: str
    entries: tuple[tuple[int, int, str, float, float], ...] = ()
    n_entries: int = 0
    world: int | None = None
    unit: str = "episode"
    """What a part is."""

    @property
    def where(self) -> str:
        """The place, as in "train-3, episode 41, step 17"."""
        world = "" if self.world is None else f"world {self.world}, "
        names = [f"{self.scenario}, {world}episode {self.number}" if self.scenario else f"{self.unit} {self.number}"]
        return ", ".join([*names, *([f"step {self.step}"] if self.step is not None else [])])

    @property
    def sentence(self) -> str:
        """In a line: "train-3, episode 41, step 17, brigade 2 in state 1193: explored, was greedy"."""
        who = "" if self.brigade is None else f", brigade {self.brigade}"
        who += "" if self.state is None else f" in state {self.state}"
        what = f"{self.what} " if self.what else ""
        return f"{self.where}{who}: {what}{self.b}, was {self.a}"


def first_difference(a: TrainingLog, b: Trained, number: int, one: Part | None, other: Part | None) -> FirstDifference:
    """Describe the first part that is not the same."""
    if one is None or other is None:
        there = one if one is not None else other
        assert there is not None  # noqa: S101 - zip_longest yields one of them
        record = next(iter(there.values()))
        words = ("is there", "is not") if other is None else ("is not", "is there")
        return _place(a, number, record, phase="end", what="", a_b=words)
    if Episode in one and Episode in other:
        return _in_episode(a, b, number, (one, other))
    for kind, record in one.items():
        for item in sorted(fields(record), key=lambda item: "per" not in item.metadata):  # figures follow from columns
            x, y = getattr(record, item.name), getattr(other.get(kind, record), item.name)
            if not np.array_equal(x, y):
                return _in_generation(a, number, record, item.name, x, y)
    raise LogError(f"part {number}: expected records of the same kinds")


def _place(
    of: Trained,
    number: int,
    record: Any,
    *,
    phase: str,
    what: str,
    a_b: tuple[str, str] | None = None,
    **rest: Any,
) -> FirstDifference:
    """Return a difference of a part."""
    values = dict(zip("ab", a_b, strict=True)) if a_b is not None else {}
    is_episode = isinstance(record, Episode)
    rest = {"step": None, "brigade": None, "state": None, **values, **rest}
    return FirstDifference(
        part=number,
        scenario=of.scenarios[record.scenario].name if is_episode else "",
        number=part_number(record),
        phase=phase,
        what=what,
        unit=of.header.unit,
        **rest,
    )


PHASE_OF: Final = {
    "fire": "draw",
    "seed": "draw",
    "weights": "draw",
    "scores": "choose",
    "score": "choose",
    "numbers": "learn",
}
"""Of what a generation or a lesson holds; the rest is known at its end."""


def _in_generation(a: Trained, number: int, record: Any, name: str, x: Any, y: Any) -> FirstDifference:
    """Name the first entry of a field that differs."""
    what, pair = name.replace("_", " "), (str(x), str(y))
    if isinstance(x, np.ndarray) and isinstance(y, np.ndarray):
        pair = (f"{len(x)} values", f"{len(y)} values")
        if x.shape == y.shape:
            k = int(np.flatnonzero(x != y)[0])
            what, pair = f"{what}[{k}]", (f"{x[k]:.12g}", f"{y[k]:.12g}")
            if isinstance(record, Tried) and name in {"weights", "scores"}:
                width = len(x) // max(1, len(record.weights) // len(record.mean))
                what = f"{name} of ranking {k // width}, {k % width}"
            if isinstance(record, Evolved) and name == "scores":
                what = f"scores of candidate {k // len(record.fire)}, {k % len(record.fire)}"
    return _place(a, number, record, phase=PHASE_OF.get(name, "end"), what=what, a_b=pair)


def _in_episode(a: TrainingLog, b: Trained, number: int, pair: tuple[Part, Part]) -> FirstDifference:
    """Name the first step, brigade and state in which two episodes differ that begin with the same tables."""
    one, other = (part[Episode] for part in pair)
    for name in ("scenario", "episode", "seed", "epsilon"):
        x, y = getattr(one, name), getattr(other, name)
        if x != y:
            return _place(a, number, one, phase="draw", what=name, a_b=(f"{x}", f"{y}"))
    before = a.trainer_before(number)  # and that of B: the parts before are the same
    x, y = (_learned_by(side, before, part) for side, part in zip((a, b), pair, strict=True))
    entries = _entries(x.tables_after, y.tables_after)
    found = _first_in_steps(x, y)
    found = found or _of_end(one, other)
    found = {"entries": entries[:ENTRIES_SHOWN], "n_entries": len(entries), **found}
    return _place(a, number, one, **found)


def _of_end(one: Episode, other: Episode) -> dict[str, Any]:
    """Return how two episodes differ whose steps are the same."""
    names = [item.name for item in fields(one) if _differs(getattr(one, item.name), getattr(other, item.name))]
    if "tables_digest" in names:
        words = [episode.tables_digest.hex()[:12] for episode in (one, other)]
        what = "values learned from the same steps, tables digest"
        return {"phase": "learn", "what": what, "a": words[0], "b": words[1]}
    name = names[0]
    return {
        "phase": "end",
        "what": name.replace("_", " "),
        "a": f"{getattr(one, name)}",
        "b": f"{getattr(other, name)}",
    }


def _learned_by(side: Trained, before: Trainer[Any, Any], part: Part) -> LearnedEpisode:
    """Return an episode as a training learned it, from the tables that both had; updates as recorded, if they are."""
    record: Episode = part[Episode]
    trainer = side.trainer()
    if not isinstance(trainer, SarsaTrainer) or not isinstance(before, SarsaTrainer):
        raise LogError(expected("method", "", "one that learns in episodes", side.method.name))
    progress = before.progress
    trainer.progress = Progress(record.scenario, record.episode, 0, progress.tables.copy(), progress.visits.copy())
    found = learned(trainer, record, side.scenarios[record.scenario])
    if Updates not in part:
        return found
    return replace(found, value_after=part[Updates].shaped(len(found.state), record.n_steps))


def _first_in_steps(x: LearnedEpisode, y: LearnedEpisode) -> dict[str, Any] | None:
    """Return the first difference in what brigades saw, chose, learned and got, step after step."""
    n_rows = min(x.td_error.shape[1], y.td_error.shape[1])
    for row in range(n_rows):
        chosen = row < min(x.state.shape[1], y.state.shape[1])
        for brigade in range(len(x.state)):
            found = _of_choice(x, y, brigade, row) if chosen else None
            found = found or _of_update(x, y, brigade, row)
            if found is not None:
                return {"step": row + 1, "brigade": brigade, **found}
        if row < min(x.reward.shape[1], y.reward.shape[1]) and (x.reward[:, row] != y.reward[:, row]).any():
            term = int(np.flatnonzero(x.reward[:, row] != y.reward[:, row])[0])
            u, v = x.reward[term, row], y.reward[term, row]
            what = f"reward {TERM_NAMES[term].replace('_', ' ')}"
            return {"step": row + 1, "phase": "reward", "what": what, "a": f"{u:.12g}", "b": f"{v:.12g}"}
        found = _of_own_reward(x, y, row)
        if found is not None:
            return found
    n_steps = x.record.n_steps, y.record.n_steps
    if n_steps[0] != n_steps[1]:
        return {"phase": "end", "what": "", "a": f"{n_steps[0]} steps", "b": f"{n_steps[1]} steps"}
    return None


def _of_own_reward(x: LearnedEpisode, y: LearnedEpisode, row: int) -> dict[str, Any] | None:
    """Return how what a brigade got for its own doing differs, where both teams learn from that."""
    if row < min(x.own_reward.shape[1], y.own_reward.shape[1]):
        for brigade in range(min(len(x.own_reward), len(y.own_reward))):
            u, v = x.own_reward[brigade, row], y.own_reward[brigade, row]
            if u != v:
                both = {"a": f"{u:.12g}", "b": f"{v:.12g}"}
                return {"step": row + 1, "brigade": brigade, "phase": "reward", "what": "own reward", **both}
    return None


def _of_choice(x: LearnedEpisode, y: LearnedEpisode, brigade: int, row: int) -> dict[str, Any] | None:
    """Return how what a brigade saw or chose in a step differs."""
    u, v = int(x.state[brigade, row]), int(y.state[brigade, row])
    how_u, how_v = CHOICES[x.choice[brigade, row]], CHOICES[y.choice[brigade, row]]
    if u != v and "none" not in (how_u, how_v):
        return {"phase": "observe", "what": "state", "a": str(u), "b": str(v)}
    act_u, act_v = int(x.action[brigade, row]), int(y.action[brigade, row])
    if how_u != how_v:
        words = [("no choice" if how == "none" else how) for how in (how_u, how_v)]
        return {"phase": "choose", "state": u, "what": "", "a": words[0], "b": words[1]}
    if act_u == act_v:
        return None
    return {"phase": "choose", "state": u, "what": "", "a": ACTIONS[act_u], "b": ACTIONS[act_v]}


def _of_update(x: LearnedEpisode, y: LearnedEpisode, brigade: int, row: int) -> dict[str, Any] | None:
    """Return how what a brigade learned in a step differs: about its choice before."""
    words = {"value_before": "value of {} before", "td_error": "TD error of {}", "value_after": "learned value of {}"}
    for name, text in words.items():
        u, v = getattr(x, name)[brigade, row], getattr(y, name)[brigade, row]
        if _differs(u, v):
            chosen = np.flatnonzero(np.isin(x.choice[brigade, :row], (GREEDY, EXPLORED)))
            state = int(x.state[brigade, chosen[-1]]) if len(chosen) else None
            what = text.format(ACTIONS[x.action[brigade, chosen[-1]]] if len(chosen) else "its choice")
            return {"phase": "learn", "state": state, "what": what, "a": f"{u:.12g}", "b": f"{v:.12g}"}
    return None


def _differs(u: Any, v: Any) -> bool:
    """Return whether two values differ; nan is nan."""
    if isinstance(u, bytes | str):
        return bool(u != v)
    return not np.array_equal(np.asarray(u, dtype=np.float64), np.asarray(v, dtype=np.float64), equal_nan=True)


def _entries(a: Array, b: Array) -> tuple[tuple[int, int, str, float, float], ...]:
    """Return the entries of tables that differ, the largest differences first."""
    if a.shape != b.shape:
        return ()
    places = np.argwhere(a != b)
    n_states = a.shape[1]
    found = [
        (int(t), first_state(int(s), n_states), ACTIONS[k], float(a[t, s, k]), float(b[t, s, k])) for t, s, k in places
    ]
    return tuple(sorted(found, key=lambda entry: (-abs(entry[3] - entry[4]), entry[:2])))
