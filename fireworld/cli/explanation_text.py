"""What `fireworld explain` found, as a table for people and as JSON."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import click

from fireworld.cli.tables import print_table

if TYPE_CHECKING:
    from fireworld_recorder.reader import Log

    from fireworld.recording.decisions import RecordedDecisions
    from fireworld.recording.explanation.search import Explanation, Found
    from fireworld.recording.explanation.stretches import Stretch

APART: Final = 0.05
"""Shares whose sum is farther than this from what all do together do not add up."""

TELLING: Final = 0.005
"""Shares below are not listed for people: they would be shown as 0 %."""

HEADS: Final = ("brigade", "steps", "decision", "explains", "all but it", "narrowed to")

OwnTargets: TypeAlias = "Callable[[Stretch], list[int]]"
"""From a stretch to the ids of the buildings that the brigade named itself in it, none with another action."""


@dataclass(frozen=True)
class Pair:
    """Two recordings, by their scores."""

    worse: Log
    better: Log
    worse_score: float
    better_score: float


def own_targets(pair: Pair, better: RecordedDecisions) -> OwnTargets:
    """Return what finds the buildings that a stretch of the better run's decisions names.

    Args:
        pair: the recordings.
        better: decisions of the better one.
    """
    from fireworld.records import ACTIONS

    def find(stretch: Stretch) -> list[int]:
        if stretch.action < len(ACTIONS):
            return []
        named = better.targets(stretch.brigade, first=stretch.first, last=stretch.last)
        return [int(pair.better.city.building_id[building]) for building in named]

    return find


def as_json_content(
    pair: Pair, explanation: Explanation, *, targets: OwnTargets, why_recorded: str, interrupted: bool
) -> dict[str, Any]:
    """Collect what is known, in plain values."""
    together = explanation.together
    return {
        "worse": {"path": str(pair.worse.path), "digest": pair.worse.digest, "score": pair.worse_score},
        "better": {"path": str(pair.better.path), "digest": pair.better.digest, "score": pair.better_score},
        "difference": pair.better_score - pair.worse_score,
        "goes_on": "recorded" if why_recorded else "policy",
        "why_recorded": why_recorded or None,
        "n_stretches": explanation.n_stretches,
        "n_tried": len(explanation.found),
        "n_replays": explanation.n_replays,
        "interrupted": interrupted,
        "together": {"score": together[0], "share": together[1]} if together else None,
        "stretches": [_stretch_as_json(one, targets) for one in explanation.found],
    }


def _stretch_as_json(one: Found, targets: OwnTargets) -> dict[str, Any]:
    from fireworld.records import ACTION_NAMES

    stretch, core = one.stretch, one.core
    return {
        "brigade": stretch.brigade,
        "first": stretch.first,
        "last": stretch.last,
        "action": ACTION_NAMES[stretch.action],
        "targets": targets(stretch),
        "instead_of": [ACTION_NAMES[action] for action in stretch.instead_of],
        "score": one.score,
        "share": one.share,
        "share_without": one.share_without,
        "narrowed": core
        and {"first": core.stretch.first, "last": core.stretch.last, "score": core.score, "share": core.share},
    }


def show(pair: Pair, explanation: Explanation, *, targets: OwnTargets, why_recorded: str, limit: int) -> None:
    """Say for people what is known."""
    better, worse = pair.better.path, pair.worse.path
    difference = pair.better_score - pair.worse_score
    click.echo(f"{better} scores {pair.better_score:.6g}, {worse} {pair.worse_score:.6g}: {difference:.6g} to explain")
    click.echo(f"{worse} replayed with decisions of {better} in it; after them {_who_goes_on(why_recorded)}")
    if explanation.n_stretches == 0:
        click.echo("no brigade took another action in steps that both runs have")
        return
    telling = [one for one in explanation.found if _is_telling(one, explanation)]
    click.echo()
    if telling:
        print_table(HEADS, [_cells(one, targets) for one in telling[:limit]], left=(HEADS.index("decision"),))
        click.echo()
    for line in _closing_lines(explanation, why_recorded=why_recorded, n_telling=len(telling), limit=limit):
        click.echo(line)


def _cells(one: Found, targets: OwnTargets) -> tuple[str, ...]:
    """Write a row of the table."""
    stretch = one.stretch
    core = f"{_span(one.core.stretch)}: {_share(one.core.share)}" if one.core else ""
    rest = _share(one.share_without) if one.share_without is not None else ""
    return str(stretch.brigade), _span(stretch), stretch.in_words(targets(stretch)), _share(one.share), rest, core


def _is_telling(one: Found, explanation: Explanation) -> bool:
    """Tell whether a stretch makes a difference, by itself or among the others."""
    lost = 0.0
    if explanation.together is not None and one.share_without is not None:
        lost = explanation.together[1] - one.share_without
    return abs(one.share) >= TELLING or abs(lost) >= TELLING


def _closing_lines(explanation: Explanation, *, why_recorded: str, n_telling: int, limit: int) -> Iterator[str]:
    """Say what the table does not: what was left out, and whether the shares add up."""
    found, n_stretches = explanation.found, explanation.n_stretches
    if n_telling > limit:
        yield f"these are the {limit} of {n_telling} that explain most; --limit shows more"
    if n_telling < len(found):
        yield f"{len(found) - n_telling} of {len(found)} stretches change next to nothing"
    if len(found) < n_stretches:
        yield f"{len(found)} of {n_stretches} stretches tried, the earliest; --budget {n_stretches + 1} tries all"
    if explanation.together is None:
        return
    score, share = explanation.together
    total = sum(one.share for one in found)
    yield f"all that were tried at once: score {score:.6g}, {_share(share)} of the difference"
    if abs(share - 1.0) > APART:
        yield f"between the stretches {_who_goes_on(why_recorded)}, in a world that neither of the runs was in"
    if len(found) > 1 and abs(total - share) > APART:
        yield (
            f"one by one they add up to {_share(total)}: they depend on each other, since each changes the world"
            " that the others act in"
        )


def _who_goes_on(why_recorded: str) -> str:
    if why_recorded:
        return f"the recorded decisions go on, whatever happens ({why_recorded})"
    return "its own policy goes on"


def _share(share: float) -> str:
    return f"{100 * share:.0f} %"


def _span(stretch: Stretch) -> str:
    return str(stretch.first) if stretch.n_steps == 1 else f"{stretch.first}-{stretch.last}"
