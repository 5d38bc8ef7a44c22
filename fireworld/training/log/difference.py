"""Two trainings compared part by part: where they first differ, and how the difference spread."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import zip_longest
from typing import Any

from fireworld_recorder.codec import encode

from fireworld.cause import Cause
from fireworld.errors import LogError, expected
from fireworld.shown import SHOWN_MAX, Block, Shown, TextTable
from fireworld.training.log.cause import training_cause
from fireworld.training.log.first_difference import FirstDifference, Trained, first_difference
from fireworld.training.log.played_difference import compare_played
from fireworld.training.log.reader import AnyTraining, Part, TrainingLog, opened
from fireworld.training.log.records import TRAINING
from fireworld.training.log.spread import SPREAD_HEADS, SPREAD_NOTE, ScenarioDifference, Spread, spread_cells


@dataclass(frozen=True, repr=False)
class TrainingDifference(Shown):
    """How training B differs from training A.

    Attributes:
        names: what they are called.
        header: what was asked for differently: name, value of A, value of B.
        cause: the same, key by key of the scenarios, in words.
        n_parts: episodes or generations compared.
        unit: what a part is.
        digests: of either, of as much as was compared.
        first: where they first differ; None: nowhere.
        spread: how, scenario by scenario.
    """

    names: tuple[str, str]
    header: Mapping[str, tuple[Any, Any]]
    cause: Cause
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
            "cause": self.cause.to_dict(),
            "first": first,
            "scenarios": [{**_plain(asdict(one)), "verdict": one.verdict} for one in self.spread],
        }

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield what changed, the first difference, and how it spread."""
        if self.first is None:
            yield f"the same: {self.n_parts} {self.unit}s"
            yield from self.cause.lines if self.cause.changes else ()
            return
        yield from self.cause.lines
        yield self.first.sentence
        yield from self.spread_blocks(limit=limit)

    def spread_blocks(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield how the first difference spread: in the tables, and scenario by scenario."""
        if self.first is not None and self.first.entries:
            yield ""
            yield f"tables after it: {self.first.n_entries} values differ"
            rows = [[f"{t}", f"{s}", action, f"{a:.6g}", f"{b:.6g}"] for t, s, action, a, b in self.first.entries]
            yield TextTable(["table", "state", "action", *self.names], rows, n_left=3)
        shown = [one for one in self.spread if not one.same]
        if shown:
            yield ""
            yield TextTable(SPREAD_HEADS, [spread_cells(one) for one in shown[:limit]])
            yield from ("", SPREAD_NOTE)
            n_same = len(self.spread) - len(shown)
            if n_same:
                yield f"{n_same} scenarios are the same"
            if len(shown) > limit:
                yield f"{len(shown) - limit} more differ; --json has all"

    def __repr__(self) -> str:
        text = f"the same: {self.n_parts} {self.unit}s" if self.first is None else self.first.sentence
        return f"<TrainingDifference {self.names[0]}, {self.names[1]}: {text}>"


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
        LogError: one cannot be read, or nothing of it; or the trainings cannot be compared: other methods, other
            numbers of brigades.
    """
    logs = [opened(one, partial=partial) for one in (a, b)]
    for log in logs:
        if log.damage is not None and not len(log):
            raise LogError(f"{log.path}: {log.damage}; there is nothing to compare")
    return compare_trainings(logs[0], logs[1], names=(str(logs[0].path), str(logs[1].path)), on_part=on_part)


def compare_trainings(
    a: TrainingLog, b: Trained, *, names: tuple[str, str], on_part: Callable[[], object] = lambda: None
) -> TrainingDifference:
    """Compare trainings part by part, each read once; arguments and errors as for `diff_trainings`."""
    _check_comparable(a, b, names)
    if a.is_played:
        n, where, scenarios = compare_played(a, b, on_part)
        return TrainingDifference(names, _header(a, b), training_cause(a, b), n, a.header.unit, where, scenarios)
    first: FirstDifference | None = None
    spread = Spread()
    n_parts = 0
    for one, other in zip_longest(a.parts(), b.parts()):
        same = one is not None and other is not None and _messages(one) == _messages(other)
        if not same and first is None:
            first = first_difference(a, b, n_parts, one, other)
        spread.add(one, other, same=same)
        n_parts += 1
        on_part()
    found = spread.scenarios([scenario.name for scenario in a.scenarios])
    return TrainingDifference(names, _header(a, b), training_cause(a, b), n_parts, a.header.unit, first, found)


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
    """Return what was asked for differently; of the simulators, where both logs know theirs."""
    both_know = bool(a.header.simulator_digest and b.header.simulator_digest)
    values = [
        {
            **one.method.as_dict(),
            "seed": one.header.seed,
            "curriculum": f"{one.header.curriculum} ({one.header.curriculum_digest[:12]})",
            "fireworld": one.header.fireworld_version,
            **({"simulator": one.header.simulator_digest[:12]} if both_know else {}),
        }
        for one in (a, b)
    ]
    keys = [*dict.fromkeys([*values[0], *values[1]])]
    return {key: (values[0].get(key), values[1].get(key)) for key in keys if values[0].get(key) != values[1].get(key)}


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values for JSON, which has no nan."""

    def plain(value: Any) -> Any:
        if isinstance(value, tuple):
            return [plain(one) for one in value]
        return None if isinstance(value, float) and math.isnan(value) else value

    return {key: plain(value) for key, value in values.items()}
