"""Two trainings compared part by part: where they first differ, in whose step, and how the difference spread."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from itertools import zip_longest
from typing import Any, Final, Protocol

import numpy as np
from fireworld_recorder.codec import encode

from fireworld.errors import LogError, expected
from fireworld.kernels.learning import EXPLORED, GREEDY
from fireworld.policy.teams.table_words import first_state
from fireworld.records import ACTIONS, CHOICES, Array
from fireworld.scenario import Scenario
from fireworld.shown import SHOWN_MAX, Block, Shown, TextTable
from fireworld.training.log.reader import LearnedEpisode, Part, TrainingLog, learned, open_training
from fireworld.training.log.records import TERM_NAMES, TRAINING, Episode, Tables, TrainingHeader, Tried, Updates
from fireworld.training.method import Method, Trainer
from fireworld.training.methods.sarsa import Progress, SarsaTrainer

ENTRIES_SHOWN: Final = 8
"""Entries of the tables that a first difference lists."""
LAST: Final = 20
"""Episodes at the end of a scenario over which return and score are averaged: as many as a policy must settle for."""

AnyTraining = str | os.PathLike[str] | TrainingLog
"""The path of a training log, or one that is open."""


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

    @property
    def where(self) -> str:
        """The place, as in "train-3, episode 41, step 17"."""
        names = [f"{self.scenario}, episode {self.number}" if self.scenario else f"generation {self.number}"]
        return ", ".join([*names, *([f"step {self.step}"] if self.step is not None else [])])

    @property
    def sentence(self) -> str:
        """In a line: "train-3, episode 41, step 17, brigade 2 in state 1193: explored, was greedy"."""
        who = "" if self.brigade is None else f", brigade {self.brigade}"
        who += "" if self.state is None else f" in state {self.state}"
        what = f"{self.what} " if self.what else ""
        return f"{self.where}{who}: {what}{self.b}, was {self.a}"


@dataclass(frozen=True)
class ScenarioDifference:
    """How two trainings compare in a scenario; of a search: in all generations.

    Attributes:
        scenario: its name.
        n_episodes: in either training.
        n_equal: episodes that are the same, of those that both have.
        first: the first that is not; None: all are.
        total_reward: the mean return of the last 20 episodes of either.
        score: the mean score of these, as a share of the maximum.
        n_steps: the mean number of steps of these.
        agreement: the share of the states that both have visited in which the final tables prefer the same action; nan
            where there is none, or a training did not finish the scenario.
        value_difference: the largest difference of a value in the final tables; nan likewise.
    """

    scenario: str
    n_episodes: tuple[int, int]
    n_equal: int
    first: int | None
    total_reward: tuple[float, float]
    score: tuple[float, float]
    n_steps: tuple[float, float]
    agreement: float
    value_difference: float

    @property
    def same(self) -> bool:
        """Whether all episodes are the same."""
        return self.first is None and self.n_episodes[0] == self.n_episodes[1]

    @property
    def verdict(self) -> str:
        """In words."""
        if self.same:
            return "the same"
        if self.first is None:
            return "one has more"
        return "differ from the first" if self.first == 0 else f"differ from {self.first} on"


@dataclass(frozen=True, repr=False)
class TrainingDifference(Shown):
    """How training B differs from training A.

    Attributes:
        names: what they are called.
        header: what was asked for differently: name, value of A, value of B.
        n_parts: episodes or generations compared.
        unit: what a part is.
        digests: of either, of as much as was compared.
        first: where they first differ; None: nowhere.
        spread: how, scenario by scenario.
    """

    names: tuple[str, str]
    header: Mapping[str, tuple[Any, Any]]
    n_parts: int
    unit: str
    first: FirstDifference | None
    spread: Sequence[ScenarioDifference] = field(default=())

    @property
    def same(self) -> bool:
        """Whether every part is the same."""
        return self.first is None

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, as `fireworld diff --json` writes them."""
        first = None if self.first is None else {**asdict(self.first), "sentence": self.first.sentence}
        return {
            "same": self.same,
            "names": list(self.names),
            "unit": self.unit,
            "n_parts_compared": self.n_parts,
            "header": {key: list(pair) for key, pair in self.header.items()},
            "first": first,
            "scenarios": [{**_plain(asdict(one)), "verdict": one.verdict} for one in self.spread],
        }

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield the first difference, what was asked for differently, and how it spread."""
        yield f"the same: {self.n_parts} {self.unit}s" if self.first is None else self.first.sentence
        for key, (a, b) in self.header.items():
            yield f"{key}: {b}, was {a}"
        if self.first is None:
            return
        if self.first.entries:
            yield ""
            yield f"tables after it: {self.first.n_entries} values differ"
            rows = [[f"{t}", f"{s}", action, f"{a:.6g}", f"{b:.6g}"] for t, s, action, a, b in self.first.entries]
            yield TextTable(["table", "state", "action", *self.names], rows, n_left=3)
        shown = [one for one in self.spread if not one.same]
        if shown:
            yield ""
            yield TextTable(SPREAD_HEADS, [_cells(one) for one in shown[:limit]])
            yield from ("", SPREAD_NOTE)
            n_same = len(self.spread) - len(shown)
            if n_same:
                yield f"{n_same} scenarios are the same"
            if len(shown) > limit:
                yield f"{len(shown) - limit} more differ; --json has all"

    def __repr__(self) -> str:
        text = f"the same: {self.n_parts} {self.unit}s" if self.first is None else self.first.sentence
        return f"<TrainingDifference {self.names[0]}, {self.names[1]}: {text}>"


SPREAD_HEADS: Final = ("scenario", "episodes", "same", "return", "score", "greedy", "largest", "differ")
SPREAD_NOTE: Final = (
    f"A/B; return, score: means of the last {LAST} episodes; greedy: states in which the\n"
    "final tables prefer the same action, of those that both have visited; largest:\n"
    "difference of a value in them; differ: the first episode that does"
)


def _cells(one: ScenarioDifference) -> list[str]:
    (n_a, n_b), (r_a, r_b), (s_a, s_b) = one.n_episodes, one.total_reward, one.score
    nothing = math.isnan(one.agreement)
    return [
        one.scenario,
        f"{n_a}/{n_b}" if n_a != n_b else str(n_a),
        str(one.n_equal),
        "-" if math.isnan(r_a) else f"{_short(r_a)}/{_short(r_b)}",
        f"{s_a:.2f}/{s_b:.2f}",
        "-" if nothing else f"{one.agreement:.0%}",
        "-" if nothing else f"{one.value_difference:.2g}",
        "the end" if one.first is None else f"from {one.first}",
    ]


def _short(value: float) -> str:
    """Write a number in six characters or so."""
    for scale, letter in ((1e6, "M"), (1e3, "k")):
        if abs(value) >= 10 * scale or (letter == "M" and abs(value) >= scale):
            return f"{value / scale:.3g}{letter}"
    return f"{value:.4g}"


def diff_trainings(
    a: AnyTraining,
    b: AnyTraining,
    *,
    partial: bool = False,
    on_part: Callable[[], object] = lambda: None,
) -> TrainingDifference:
    """Compare training B with training A.

    Args:
        a: the path of a training log, or a log that is open.
        b: the other.
        partial: compare a cut-off or damaged log too, as far as it is good.
        on_part: called after each part.

    Raises:
        LogError: one cannot be read, or the trainings cannot be compared: other methods, other numbers of brigades.
    """
    logs = [one if isinstance(one, TrainingLog) else open_training(one, partial=partial) for one in (a, b)]
    return compare_trainings(logs[0], logs[1], names=(str(logs[0].path), str(logs[1].path)), on_part=on_part)


def compare_trainings(
    a: TrainingLog, b: Trained, *, names: tuple[str, str], on_part: Callable[[], object] = lambda: None
) -> TrainingDifference:
    """Compare trainings part by part, each read once; arguments and errors as for `diff_trainings`."""
    _check_comparable(a, b, names)
    first: FirstDifference | None = None
    spread = Spread()
    n_parts = 0
    for one, other in zip_longest(a.parts(), b.parts()):
        same = one is not None and other is not None and _messages(one) == _messages(other)
        if not same and first is None:
            first = _first_difference(a, b, n_parts, one, other)
        spread.add(one, other, same=same)
        n_parts += 1
        on_part()
    found = spread.scenarios([scenario.name for scenario in a.scenarios])
    return TrainingDifference(names, _header(a, b), n_parts, a.header.unit, first, found)


def _messages(part: Part) -> list[bytes]:
    """Return what identifies a part: what is chained."""
    return [encode(record) for kind, record in part.items() if kind.topic not in TRAINING.unchained]


def _check_comparable(a: Trained, b: Trained, names: tuple[str, str]) -> None:
    if a.method.name != b.method.name or a.header.unit != b.header.unit:
        raise LogError(expected(names[1], "method", f"{a.method.name}, as in {names[0]}", b.method.name))
    pairs = list(zip(a.scenarios, b.scenarios, strict=False))
    for one, other in pairs:
        if one.brigades.n != other.brigades.n:
            wanted = f"{one.brigades.n} in {one.name}, as in {names[0]}"
            raise LogError(expected(names[1], "brigades", wanted, f"{other.brigades.n} in {other.name}"))


def _header(a: Trained, b: Trained) -> dict[str, tuple[Any, Any]]:
    """Return what was asked for differently."""
    values = [
        {
            **one.method.as_dict(),
            "seed": one.header.seed,
            "curriculum": f"{one.header.curriculum} ({one.header.curriculum_digest[:12]})",
            "fireworld": one.header.fireworld_version,
        }
        for one in (a, b)
    ]
    keys = [*dict.fromkeys([*values[0], *values[1]])]
    return {key: (values[0].get(key), values[1].get(key)) for key in keys if values[0].get(key) != values[1].get(key)}


def _first_difference(a: TrainingLog, b: Trained, number: int, one: Part | None, other: Part | None) -> FirstDifference:
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
        number=record.episode if is_episode else getattr(record, "generation", number),
        phase=phase,
        what=what,
        **rest,
    )


PHASE_OF: Final = {"fire": "draw", "seed": "draw", "weights": "draw", "scores": "choose"}
"""Of what a search holds; the rest is known at the end of a generation."""


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
    n_steps = x.record.n_steps, y.record.n_steps
    if n_steps[0] != n_steps[1]:
        return {"phase": "end", "what": "", "a": f"{n_steps[0]} steps", "b": f"{n_steps[1]} steps"}
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


class Spread:
    """How two trainings compare, scenario by scenario, from their parts in order."""

    def __init__(self) -> None:
        self._lines: dict[int, tuple[dict[int, Any], dict[int, Any]]] = {}
        self._same: dict[int, set[int]] = {}
        self._tables: dict[int, list[Tables | None]] = {}

    def add(self, one: Part | None, other: Part | None, *, same: bool) -> None:
        """Add the next part of both."""
        for side, part in enumerate((one, other)):
            if part is None:
                continue
            key, number, line = _line(part)
            self._lines.setdefault(key, ({}, {}))[side][number] = line
            if same:
                self._same.setdefault(key, set()).add(number)
            if Tables in part and part[Episode].ended:
                self._tables.setdefault(key, [None, None])[side] = part[Tables]

    def scenarios(self, names: Sequence[str]) -> list[ScenarioDifference]:
        """Return the comparison of each scenario, in the order of the plan."""
        found = []
        for key, sides in sorted(self._lines.items()):
            same = self._same.get(key, set())
            both = sorted(sides[0].keys() & sides[1].keys())
            agreement, largest = _compare_tables(*self._tables.get(key, [None, None]))
            means = [_means(side) for side in sides]
            found.append(
                ScenarioDifference(
                    scenario=names[key] if key >= 0 else "all",
                    n_episodes=(len(sides[0]), len(sides[1])),
                    n_equal=len(same),
                    first=next((number for number in both if number not in same), None),
                    total_reward=(means[0][0], means[1][0]),
                    score=(means[0][1], means[1][1]),
                    n_steps=(means[0][2], means[1][2]),
                    agreement=agreement,
                    value_difference=largest,
                )
            )
        return found


def _line(part: Part) -> tuple[int, int, tuple[float, float, float]]:
    """Return scenario (-1: all), number, and return, score and steps of a part."""
    record = next(iter(part.values()))
    if isinstance(record, Episode):
        score = record.score / record.score_max if record.score_max else 0.0
        return record.scenario, record.episode, (record.total_reward, score, float(record.n_steps))
    score = float(getattr(record, "score_mean", np.nan))
    return -1, int(getattr(record, "generation", 0)), (np.nan, score, np.nan)


def _means(side: Mapping[int, tuple[float, float, float]]) -> tuple[float, ...]:
    """Return the means over the last episodes."""
    last = [side[number] for number in sorted(side)[-LAST:]]
    return tuple(float(np.mean([line[k] for line in last])) if last else float("nan") for k in range(3))


def _compare_tables(a: Tables | None, b: Tables | None) -> tuple[float, float]:
    """Return how often two sets of tables prefer the same action where both have been, and the largest difference."""
    if a is None or b is None or (a.n_tables, a.n_states) != (b.n_tables, b.n_states):
        return float("nan"), float("nan")
    (values_a, visits_a), (values_b, visits_b) = a.arrays, b.arrays
    both = visits_a.any(axis=2) & visits_b.any(axis=2)
    same = values_a.argmax(axis=2) == values_b.argmax(axis=2)
    agreement = float(same[both].mean()) if both.any() else float("nan")
    return agreement, float(np.abs(values_a - values_b).max())


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values for JSON, which has no nan."""

    def plain(value: Any) -> Any:
        if isinstance(value, tuple):
            return [plain(one) for one in value]
        return None if isinstance(value, float) and math.isnan(value) else value

    return {key: plain(value) for key, value in values.items()}
