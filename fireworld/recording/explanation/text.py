"""An explanation in words and cells, for the terminal and for notebooks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from fireworld.recording.inputs import run_name

if TYPE_CHECKING:
    from fireworld.recording.explain import Explanation
    from fireworld.recording.explanation.search import SpanEffect

APART: Final = 0.05
"""Shares whose sum is farther than this from what all do together do not add up."""
LISTED_SHARE: Final = 0.005
"""Shares below are not listed: they would be shown as 0 %."""
SMALL_DIFFERENCE: Final = 0.01
"""Differences below this part of the highest score are not shared out: shares of next to nothing say nothing."""
HEADS: Final = ("brigade", "steps", "decision", "explains", "all but it", "narrowed to")


def opening_lines(explanation: Explanation) -> Iterator[str]:
    """Yield what is to be explained, and how."""
    better, worse = run_name(explanation.better), run_name(explanation.worse)
    if explanation.difference == 0:
        yield f"both runs have the score {explanation.worse_score:.6g}: there is no difference to explain"
        return
    scores = f"{better} scores {explanation.better_score:.6g}, {worse} {explanation.worse_score:.6g}"
    yield f"{scores}: {explanation.difference:.6g} to explain"
    yield f"{worse} replayed with decisions of {better} in it; after them {_what_continues(explanation)}"
    if explanation.is_small:
        yield f"that is less than {_percent(SMALL_DIFFERENCE)} of the highest score: changes of it, no shares"
    if explanation.n_spans == 0:
        yield "no brigade took another action in steps that both runs have"


def rows(explanation: Explanation, *, limit: int) -> list[tuple[str, ...]]:
    """Return a row of the table for each span that makes a difference, at most `limit`; columns as in HEADS."""
    return [_cells(one, explanation) for one in listed(explanation)[:limit]]


def listed(explanation: Explanation) -> list[SpanEffect]:
    """Return the effects of the spans that make a difference, alone or among the others."""

    def lost(one: SpanEffect) -> float:
        together = explanation.together
        return 0.0 if together is None or one.share_without is None else together[1] - one.share_without

    return [one for one in explanation.effects if max(abs(one.share), abs(lost(one))) >= LISTED_SHARE]


def closing_lines(explanation: Explanation, *, limit: int) -> Iterator[str]:
    """Yield what the table does not have: what was left out, and whether the shares add up."""
    effects, n_spans, n_listed = explanation.effects, explanation.n_spans, len(listed(explanation))
    if n_listed > limit:
        yield f"these are the {limit} of {n_listed} that explain most; --limit shows more"
    if n_listed < len(effects):
        yield f"{len(effects) - n_listed} of {len(effects)} spans change next to nothing"
    if len(effects) < n_spans:
        yield f"{len(effects)} of {n_spans} spans tried, the earliest; --budget {n_spans + 1} tries all"
    if explanation.together is None:
        return
    score, share = explanation.together
    total = sum(one.share for one in effects)
    yield f"all that were tried at once: score {score:.6g}, {_part(share, explanation)} of the difference"
    if abs(share - 1.0) > APART:
        yield f"between the spans {_what_continues(explanation)}, in a world that neither of the runs was in"
    if len(effects) > 1 and abs(total - share) > APART:
        yield (
            f"one by one they add up to {_part(total, explanation)}: they depend on each other, since each"
            " changes the world that the others act in"
        )


def _cells(one: SpanEffect, explanation: Explanation) -> tuple[str, ...]:
    span, core = one.span, one.core
    return (
        str(span.brigade),
        span.steps,
        span.text(explanation.targets(span)),
        _part(one.share, explanation),
        _part(one.share_without, explanation) if one.share_without is not None else "",
        f"{core.span.steps}: {_part(core.share, explanation)}" if core else "",
    )


def _what_continues(explanation: Explanation) -> str:
    if explanation.why_recorded:
        return f"the recorded decisions continue, whatever happens ({explanation.why_recorded})"
    return "its own policy continues"


def _part(share: float, explanation: Explanation) -> str:
    """Return a share of the difference in percent; as a change of the score where the difference is small."""
    return f"{share * explanation.difference:+.3g}" if explanation.is_small else _percent(share)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
