"""`fireworld policy`: what a trained team does and why, and how two teams differ."""

from __future__ import annotations

import json
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from fireworld.policy.inspection import TeamDifference
    from fireworld.policy.preferences import RankingDifference
    from fireworld.policy.ranking import Ranking
    from fireworld.policy.team import Team

SHOWN_MAX = 20
SHOWN_OPTION = click.option(
    "--limit",
    default=SHOWN_MAX,
    show_default=True,
    type=click.IntRange(min=1),
    metavar="N",
    help="List N states, or weights that differ, at most.",
)


@click.group()
def command() -> None:
    """Say what a trained team does and why, or how two teams differ.

    A team is a team file, or the name of a team that comes with fireworld.
    """


@command.command()
@click.argument("team", metavar="TEAM")
@click.argument("states", metavar="[STATE]...", nargs=-1)
@SHOWN_OPTION
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
def show(*, team: str, states: tuple[str, ...], limit: int, as_json: bool) -> None:
    """Say what a team does: how much it has seen, what it prefers, and in each STATE what it does and why.

    A STATE is its number in recordings, 0 to 4319, or some of its features; then all states that have them are meant,
    and those visited in training are listed. A team that ranks targets has no states: its weights are listed, and what
    they come to in words; "above all" means weights of at least half the largest one, "also" of a fifth, "a little" of
    a twentieth.

    \b
    fireworld policy show team.npz
    fireworld policy show team.npz 1193
    fireworld policy show team.npz free_edges=3,volume=high,distance_from_civilian=low
    fireworld policy show paper-cooperative

    Exit code: 0 shown, 2 no such team or state.
    """
    from fireworld.cli.ranking_text import ranking_as_json, show_ranking
    from fireworld.cli.team_text import origin_lines, short_provenance, show_states, show_team, team_as_json
    from fireworld.errors import PolicyError, expected
    from fireworld.policy.ranking import Ranking
    from fireworld.policy.words import find_states

    loaded = _load(team)
    if isinstance(loaded, Ranking):
        if states:
            raise PolicyError(expected("STATE", "", "none: a ranking of targets has no states", states[0]))
        if as_json:
            click.echo(json.dumps(ranking_as_json(loaded, provenance=short_provenance(loaded)), indent=2))
        else:
            show_ranking(loaded, team, origin=origin_lines(loaded))
        return
    asked = [(text, find_states(text)) for text in states]
    if as_json:
        click.echo(json.dumps(team_as_json(loaded, asked, limit=limit), indent=2))
        return
    show_team(loaded, team)
    for text, found in asked:
        show_states(loaded, text, found, limit=limit)


@command.command()
@click.argument("first", metavar="A")
@click.argument("second", metavar="B")
@click.option("--actions-only", is_flag=True, help="Other values that lead to the same actions are no difference.")
@SHOWN_OPTION
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.pass_context
def diff(context: click.Context, *, first: str, second: str, actions_only: bool, limit: int, as_json: bool) -> None:
    """Compare team B with team A: in which states which brigade would do something else.

    Of two teams that rank targets, the weights that differ are listed.

    \b
    fireworld policy diff team.npz paper-cooperative

    Exit code: 0 the same, 1 different, 2 could not compare.
    """
    from fireworld.cli.ranking_text import ranking_difference_as_json, show_ranking_difference
    from fireworld.cli.team_text import difference_as_json, show_difference
    from fireworld.errors import TrainingError, expected
    from fireworld.policy.inspection import compare
    from fireworld.policy.preferences import RankingDifference, compare_rankings
    from fireworld.policy.ranking import Ranking

    a, b = _load(first), _load(second)
    difference: TeamDifference | RankingDifference
    if isinstance(a, Ranking) and isinstance(b, Ranking):
        if actions_only:
            raise TrainingError(expected("--actions-only", "", "two teams with tables of actions", "two rankings"))
        difference = compare_rankings(a, b)
        same, details = difference.same, ranking_difference_as_json(difference, limit=limit)
    elif isinstance(a, Ranking) or isinstance(b, Ranking):
        words = ["a ranking of targets" if isinstance(one, Ranking) else "tables of actions" for one in (a, b)]
        raise TrainingError(expected(second, "", f"{words[0]}, as in {first}", words[1]))
    else:
        difference = compare(a, b)
        same = difference.same_actions if actions_only else difference.same
        details = difference_as_json(difference, limit=limit)
    if as_json:
        click.echo(json.dumps({"same": same, "digests": [a.digest, b.digest], **details}, indent=2))
    elif isinstance(difference, RankingDifference):
        show_ranking_difference(difference, limit=limit)
    else:
        show_difference(difference, limit=limit)
    context.exit(0 if same else 1)


def _load(name: str) -> Team | Ranking:
    """Read a team that comes with fireworld, or a team file of either kind.

    Raises:
        TrainingError: no such team, or a file that is none.
    """
    from fireworld.errors import TrainingError, expected
    from fireworld.policy.files import load_team_file
    from fireworld.policy.shipped import team_names, team_path

    names = team_names()
    if name not in names and not Path(name).suffix and not Path(name).exists():
        near = get_close_matches(name, names, n=1)
        wanted = "a team file (.npz) or one of " + ", ".join(names)
        raise TrainingError(expected("TEAM", "", wanted, name, f"try {near[0]}" if near else ""))
    return load_team_file(team_path(name) if name in names else Path(name))
