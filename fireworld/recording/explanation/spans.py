"""Decision spans: where the brigades of two runs decided differently, brigade by brigade, as decisions to force."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from fireworld.recording.decisions import RecordedDecisions
from fireworld.records import ACTION_NAMES


@dataclass(frozen=True)
class DecisionSpan:
    """Steps in which one brigade takes one action instead of those it took (or other targets of its own)."""

    brigade: int
    first: int
    last: int
    action: int
    instead_of: tuple[int, ...]

    def __str__(self) -> str:
        """Write it, as in "nearest-to-me instead of easiest"."""
        return self.text()

    def text(self, targets: Sequence[int] = ()) -> str:
        """Write it with the buildings that the brigade names itself, as in "own-target:301 instead of easiest".

        Args:
            targets: their ids; of several only the number is written.
        """
        now = ACTION_NAMES[self.action]
        if targets:
            now = f"{now}:{targets[0]}" if len(targets) == 1 else f"{now} ({len(targets)} buildings)"
        before = ["other targets" if action == self.action else ACTION_NAMES[action] for action in self.instead_of]
        return f"{now} instead of {' or '.join(before)}"

    @property
    def n_steps(self) -> int:
        """How long it is."""
        return self.last - self.first + 1

    @property
    def steps(self) -> str:
        """The steps, as in "14-22" or "5"."""
        return str(self.first) if self.n_steps == 1 else f"{self.first}-{self.last}"

    def covers(self, brigade: int, step: int) -> bool:
        """Return whether it is about a brigade in a step."""
        return brigade == self.brigade and self.first <= step <= self.last

    def halves(self) -> tuple[DecisionSpan, DecisionSpan]:
        """Cut it in two; the first half has the odd step. It must have two steps or more."""
        middle = (self.first + self.last) // 2
        return replace(self, last=middle), replace(self, first=middle + 1)


def find_spans(worse: RecordedDecisions, better: RecordedDecisions, *, n_brigades: int) -> list[DecisionSpan]:
    """Find the longest spans in which a brigade took one action in the better run and others in the worse.

    Steps in which it had no choice in one of the runs (it refilled) neither begin nor end a span.

    Returns:
        The spans by their first step, then by brigade.
    """
    found = [span for brigade in range(n_brigades) for span in _of_brigade(worse, better, brigade)]
    return sorted(found, key=lambda span: (span.first, span.brigade))


def span_at(spans: Sequence[DecisionSpan], brigade: int, step: int) -> DecisionSpan | None:
    """Return the span that is about a brigade in a step; None if there is none."""
    return next((span for span in spans if span.covers(brigade, step)), None)


def _of_brigade(worse: RecordedDecisions, better: RecordedDecisions, brigade: int) -> Iterator[DecisionSpan]:
    now: DecisionSpan | None = None
    for step in range(1, min(worse.last_step, better.last_step) + 1):
        bad, good = worse.made(step, brigade), better.made(step, brigade)
        if bad is None or good is None:
            continue
        alike = (good.action, good.target) == (bad.action, bad.target)
        if now is not None and (alike or good.action != now.action):
            yield now
            now = None
        if not alike:
            before = now.instead_of if now is not None else ()
            seen = before if bad.action in before else (*before, bad.action)
            first = now.first if now is not None else step
            now = DecisionSpan(brigade, first, step, good.action, seen)
    if now is not None:
        yield now
