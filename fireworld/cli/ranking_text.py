"""A ranking, and what differs between two, as text and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from fireworld.cli.tables import print_table

if TYPE_CHECKING:
    from fireworld.policy.preferences import RankingDifference
    from fireworld.policy.ranking import Ranking

HINT = "a weight counts by its size and by how much what it weighs differs from target to target; mind the units"


def kind_words(*, own_targets: bool) -> str:
    """Say among what a ranking chooses."""
    return "all burning buildings of the fire site" if own_targets else "the targets of the paper's four actions"


def show_ranking(ranking: Ranking, name: str, *, origin: Sequence[str]) -> None:
    """Show what a ranking is, its weights and what they come to.

    Args:
        ranking: the weights.
        name: of its file.
        origin: where it comes from, in lines.
    """
    from fireworld.policy.preferences import by_size, sentences
    from fireworld.policy.ranking import WEIGHTS

    n = len(ranking.weights)
    whose = "one row of weights for all brigades" if n == 1 else f"{n} rows of weights, one for each brigade in turn"
    click.echo(f"{name}: a ranking of {kind_words(own_targets=ranking.own_targets)}, {whose}")
    for line in (*origin, f"digest {ranking.digest}"):
        click.echo(line)
    place = {weight.name: k for k, weight in enumerate(WEIGHTS)}
    rows = [
        [weight.name, weight.meaning, *map(_signed, ranking.weights[:, place[weight.name]])]
        for weight in by_size(ranking)
    ]
    click.echo()
    print_table(["weight", "of what", *_columns(n)], rows, left=(0, 1), whole=(0,))
    click.echo(f"\n{HINT}")
    for row in range(n):
        if n > 1:
            click.echo(f"\nbrigade {row}")
        else:
            click.echo()
        for sentence in sentences(ranking, row=row):
            click.echo(sentence)


def ranking_as_json(ranking: Ranking, *, provenance: dict[str, Any]) -> dict[str, Any]:
    """Return a ranking as plain values."""
    from fireworld.policy.preferences import by_size, counted, preferences
    from fireworld.policy.ranking import WEIGHTS

    place = {weight.name: k for k, weight in enumerate(WEIGHTS)}
    idle = [weight for weight in WEIGHTS if weight not in counted(ranking)]
    return {
        "digest": ranking.digest,
        "own_targets": ranking.own_targets,
        "n_rows": len(ranking.weights),
        "provenance": provenance,
        "weights": [
            {
                "name": weight.name,
                "meaning": weight.meaning,
                "counts": weight not in idle,
                "values": ranking.weights[:, place[weight.name]].tolist(),
            }
            for weight in (*by_size(ranking), *idle)
        ],
        "preferences": [
            [
                {"weight": one.weight.name, "strength": one.strength, "words": one.words}
                for one in preferences(ranking, row=row)
            ]
            for row in range(len(ranking.weights))
        ],
    }


def show_ranking_difference(difference: RankingDifference, *, limit: int) -> None:
    """Show which weights differ."""
    if difference.same:
        click.echo(f"the same: {difference.n_rows} row{'s' if difference.n_rows > 1 else ''} of weights")
        return
    a, b = (kind_words(own_targets=own) for own in difference.own_targets)
    if a != b:
        click.echo(f"A ranks {a}, B {b}")
    n = len(difference.changed)
    click.echo(f"{n} weight{'' if n == 1 else 's'} differ{'s' if n == 1 else ''}")
    if not n:
        return
    rows = [
        [
            one.name,
            *([f"brigade {one.row}"] if difference.n_rows > 1 else []),
            *(f"{value:+.6g}" for value in (one.a, one.b, one.b - one.a)),
        ]
        for one in difference.changed[:limit]
    ]
    whose = ["of"] if difference.n_rows > 1 else []
    click.echo()
    print_table(["weight", *whose, "A", "B", "B less A"], rows, left=range(1 + len(whose)), whole=(0,))
    if n > limit:
        click.echo(f"... and {n - limit} more; --limit shows more of them")


def ranking_difference_as_json(difference: RankingDifference, *, limit: int) -> dict[str, Any]:
    """Return what differs as plain values."""
    return {
        "n_rows": difference.n_rows,
        "n_changed": len(difference.changed),
        "own_targets": list(difference.own_targets),
        "changed": [{"row": one.row, "weight": one.name, "a": one.a, "b": one.b} for one in difference.changed[:limit]],
    }


def _columns(n_rows: int) -> list[str]:
    return ["value"] if n_rows == 1 else [f"brigade {row}" for row in range(n_rows)]


def _signed(value: float) -> str:
    return f"{value:+.3f}" if value else "0"
