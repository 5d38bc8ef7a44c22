"""`fireworld policy`: what a trained team does and why, and how two teams differ."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from fireworld.policy.inspection import Choice, TeamDifference
    from fireworld.policy.team import Team

SHOWN_MAX = 20
SHOWN_OPTION = click.option(
    "--limit",
    default=SHOWN_MAX,
    show_default=True,
    type=click.IntRange(min=1),
    metavar="N",
    help="List N states at most.",
)


@click.group()
def command() -> None:
    """Say what a trained team does and why, or how two teams differ."""


@command.command()
@click.argument("team", metavar="TEAM.npz", type=click.Path(path_type=Path))
@click.argument("states", metavar="[STATE]...", nargs=-1)
@SHOWN_OPTION
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
def show(*, team: Path, states: tuple[str, ...], limit: int, as_json: bool) -> None:
    """Say what a team does: how much it has seen, what it prefers, and in each STATE what it does and why.

    A STATE is its number in recordings, 0 to 4319, or some of its features; then all states that have them are meant,
    and those visited in training are listed.

    \b
    fireworld policy show team.npz
    fireworld policy show team.npz 1193
    fireworld policy show team.npz free_edges=3,volume=high,distance_from_civilian=low
    """  # noqa: D301 - click wants the character
    from fireworld.policy.team import load_team
    from fireworld.policy.words import find_states

    loaded = load_team(team)
    asked = [(text, find_states(text)) for text in states]
    if as_json:
        click.echo(json.dumps(_as_json(loaded, asked, limit=limit), indent=2))
        return
    _show_summary(loaded, str(team))
    for text, found in asked:
        _show_states(loaded, text, found, limit=limit)


@command.command()
@click.argument("first", metavar="A", type=click.Path(path_type=Path))
@click.argument("second", metavar="B", type=click.Path(path_type=Path))
@click.option("--actions-only", is_flag=True, help="Other values that lead to the same actions are no difference.")
@SHOWN_OPTION
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.pass_context
def diff(context: click.Context, *, first: Path, second: Path, actions_only: bool, limit: int, as_json: bool) -> None:
    """Compare team B with team A: in which states which brigade would do something else.

    Exit code: 0 the same, 1 different, 2 could not compare.
    """
    from fireworld.policy.inspection import compare
    from fireworld.policy.team import load_team

    a, b = load_team(first), load_team(second)
    difference = compare(a, b)
    same = difference.same_actions if actions_only else difference.same
    if as_json:
        content = {"same": same, "digests": [a.digest, b.digest], **_difference_as_json(difference, limit=limit)}
        click.echo(json.dumps(content, indent=2))
    else:
        _show_difference(difference, limit=limit)
    context.exit(0 if same else 1)


def _show_summary(team: Team, name: str) -> None:
    from fireworld.policy.inspection import agreement, summarize
    from fireworld.records import ACTIONS

    n_tables, n_states, _ = team.tables.shape
    sees = "with what the others do" if n_states > 270 else "without what the others do"
    click.echo(f"{name}: {n_tables} table{'s' if n_tables > 1 else ''} of {n_states} states, {sees}")
    for line in _origin(team):
        click.echo(line)
    click.echo(f"digest {team.digest}")
    summaries = summarize(team)
    rows = [["states visited", *(str(summary.n_visited) for summary in summaries)]]
    rows += [
        [action, *(_share(summary.n_by_action[k], summary.n_visited) for summary in summaries)]
        for k, action in enumerate(ACTIONS)
    ]
    _print_table(["", *(f"brigade {number}" for number in range(n_tables))], rows)
    if n_tables > 1:
        same, common = agreement(team)
        click.echo(f"\nof {common} states that all visited, all prefer the same action in {same}")


def _share(n: int, n_all: int) -> str:
    return f"{100 * n / n_all:.0f} %" if n_all else "-"


def _origin(team: Team) -> list[str]:
    """Say where a team comes from, as far as its file tells."""
    curriculum, method = team.provenance.get("curriculum"), team.provenance.get("method")
    lines = []
    if isinstance(curriculum, dict):
        seed, done = team.provenance.get("seed"), team.provenance.get("scenarios_done")
        lines.append(f"trained in {curriculum.get('name')}, {done} scenarios, seed {seed}")
    if isinstance(method, dict):
        lines.append("method " + ", ".join(f"{key} {value}" for key, value in method.items()))
    return lines


def _show_states(team: Team, text: str, found: Sequence[int], *, limit: int) -> None:
    """Show what each table does in the states that were asked for."""
    from fireworld.policy.inspection import choice
    from fireworld.policy.words import describe_state

    n_tables, n_states, _ = team.tables.shape
    states = _rows_of(found, n_states)
    chosen = [[choice(team, table=table, state=state) for table in range(n_tables)] for state in states]
    listed = chosen
    if len(states) > 1:
        listed = [choices for choices in chosen if any(one.visited for one in choices)]
        click.echo(f"\n{text}: {len(states)} states, {len(listed)} of them visited in training")
    for choices in listed[:limit]:
        state = choices[0].state
        click.echo(f"\nstate {state}: {describe_state(state, with_others=n_states > 270)}")
        _show_choices(choices)
    if len(listed) > limit:
        click.echo(f"\n... and {len(listed) - limit} more; --limit shows more of them")


def _show_choices(choices: Sequence[Choice]) -> None:
    from fireworld.records import ACTIONS

    rows = []
    for k, action in enumerate(ACTIONS):
        cells = [f"{'> ' if one.action == k else ''}{_number(one.q_values[k])} ({one.visits[k]})" for one in choices]
        rows.append([action, *cells])
    _print_table(["value (times tried)", *(f"brigade {one.table}" for one in choices)], rows)
    for why in dict.fromkeys(one.why for one in choices):
        brigades = ", ".join(str(one.table) for one in choices if one.why == why)
        click.echo(f"brigade {brigades}: {why}")


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def _show_difference(difference: TeamDifference, *, limit: int) -> None:
    from fireworld.policy.words import short_state
    from fireworld.records import ACTIONS

    if difference.commit[0] != difference.commit[1]:
        click.echo(f"choices are kept for {difference.commit[0]} / {difference.commit[1]} steps")
    if difference.same:
        click.echo(f"the same: {difference.n_states} states")
        return
    n_states = len({a.state for a, _ in difference.changed})
    click.echo(
        f"another action in {n_states} of {difference.n_states} states, {len(difference.changed)} entries over all "
        f"brigades; {difference.n_values_only} more with other values and the same action"
    )
    if not difference.changed:
        return
    counts = [
        [name, ", ".join(f"{value} {n}" for value, n in values.items() if n)]
        for name, values in difference.by_feature()
    ]
    _print_table(["feature", "changed entries by its value"], counts, right=False)
    click.echo()
    for a, b in difference.changed[:limit]:
        state = short_state(a.state, with_others=difference.n_states > 270)
        click.echo(
            f"brigade {a.table}, state {a.state}: {ACTIONS[a.action]} / {ACTIONS[b.action]}, "
            f"visits {sum(a.visits)} / {sum(b.visits)}; {state}"
        )
    if len(difference.changed) > limit:
        click.echo(f"... and {len(difference.changed) - limit} more; --limit shows more of them")


def _as_json(team: Team, asked: Sequence[tuple[str, Sequence[int]]], *, limit: int) -> dict[str, Any]:
    from fireworld.policy.inspection import choice, summarize

    n_tables, n_states, _ = team.tables.shape
    origin = {key: value for key, value in team.provenance.items() if key != "curriculum"}
    curriculum = team.provenance.get("curriculum")
    if isinstance(curriculum, dict):
        origin["curriculum"] = {key: curriculum.get(key) for key in ("name", "digest")}
    rows = [state for _, found in asked for state in _rows_of(found, n_states)[:limit]]
    return {
        "digest": team.digest,
        "n_tables": n_tables,
        "n_states": n_states,
        "provenance": origin,
        "tables": [{"n_visited": summary.n_visited, "n_by_action": summary.n_by_action} for summary in summarize(team)],
        "states": [
            _choice_as_json(choice(team, table=table, state=state)) for state in rows for table in range(n_tables)
        ],
    }


def _choice_as_json(one: Choice) -> dict[str, Any]:
    from fireworld.records import ACTIONS

    return {
        "state": one.state,
        "brigade": one.table,
        "action": ACTIONS[one.action],
        "q_values": one.q_values,
        "visits": one.visits,
        "why": one.why,
    }


def _difference_as_json(difference: TeamDifference, *, limit: int) -> dict[str, Any]:
    return {
        "n_states": difference.n_states,
        "n_changed": len(difference.changed),
        "n_values_only": difference.n_values_only,
        "commit": difference.commit,
        "by_feature": dict(difference.by_feature()),
        "changed": [[_choice_as_json(a), _choice_as_json(b)] for a, b in difference.changed[:limit]],
    }


def _rows_of(states: Sequence[int], n_states: int) -> list[int]:
    """Return the states, those that a table of 270 states does not tell apart only once."""
    from fireworld.policy.words import N_STATES

    step = N_STATES // n_states
    return list(dict.fromkeys(state // step * step for state in states))


def _print_table(head: Sequence[str], rows: Sequence[Sequence[str]], *, right: bool = True) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE, show_edge=False, pad_edge=False)
    for index, name in enumerate(head):
        table.add_column(name, justify="right" if index and right else "left", no_wrap=not index, overflow="fold")
    for row in rows:
        table.add_row(*row)
    click.echo()
    Console(highlight=False, markup=False).print(table)
