"""A team with tables, in states and overall, and what differs between two, as text and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from fireworld.cli.tables import print_table

if TYPE_CHECKING:
    from fireworld.policy.inspection import Choice, TeamDifference
    from fireworld.policy.ranking import Ranking
    from fireworld.policy.team import Team


def show_team(team: Team, name: str) -> None:
    """Show what a team is and how much each table has seen and prefers."""
    from fireworld.policy.inspection import agreement, summarize
    from fireworld.records import ACTIONS

    n_tables, n_states, _ = team.tables.shape
    sees = "with what the others do" if n_states > 270 else "without what the others do"
    click.echo(f"{name}: {n_tables} table{'s' if n_tables > 1 else ''} of {n_states} states, {sees}")
    for line in origin_lines(team):
        click.echo(line)
    click.echo(f"digest {team.digest}")
    summaries = summarize(team)
    rows = [["states visited", *(str(summary.n_visited) for summary in summaries)]]
    rows += [
        [action, *(_share(summary.n_by_action[k], summary.n_visited) for summary in summaries)]
        for k, action in enumerate(ACTIONS)
    ]
    click.echo()
    print_table(["", *(f"brigade {number}" for number in range(n_tables))], rows, whole=(0,))
    if n_tables > 1:
        same, common = agreement(team)
        click.echo(f"\nof {common} states that all visited, all prefer the same action in {same}")


def _share(n: int, n_all: int) -> str:
    return f"{100 * n / n_all:.0f} %" if n_all else "-"


def origin_lines(team: Team | Ranking) -> list[str]:
    """Say where a team comes from, as far as its file tells."""
    told = team.provenance
    curriculum, method = told.get("curriculum"), told.get("method")
    lines = []
    if isinstance(curriculum, dict):
        searched = "generations_done" in told
        done = f"{told['generations_done']} generations" if searched else f"{told.get('scenarios_done')} scenarios"
        lines.append(f"trained in {curriculum.get('name')}, {done}, seed {told.get('seed')}")
    if isinstance(method, dict):
        lines.append("method " + ", ".join(f"{key} {value}" for key, value in method.items()))
    return lines


def show_states(team: Team, text: str, found: Sequence[int], *, limit: int) -> None:
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
    click.echo()
    print_table(["value (times tried)", *(f"brigade {one.table}" for one in choices)], rows, whole=(0,))
    for why in dict.fromkeys(one.why for one in choices):
        brigades = ", ".join(str(one.table) for one in choices if one.why == why)
        click.echo(f"brigade {brigades}: {why}")


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def show_difference(difference: TeamDifference, *, limit: int) -> None:
    """Show in which states two teams do something else."""
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
    click.echo()
    print_table(["feature", "changed entries by its value"], counts, left=(0, 1), whole=(0,))
    click.echo()
    for a, b in difference.changed[:limit]:
        state = short_state(a.state, with_others=difference.n_states > 270)
        click.echo(
            f"brigade {a.table}, state {a.state}: {ACTIONS[a.action]} / {ACTIONS[b.action]}, "
            f"visits {sum(a.visits)} / {sum(b.visits)}; {state}"
        )
    if len(difference.changed) > limit:
        click.echo(f"... and {len(difference.changed) - limit} more; --limit shows more of them")


def team_as_json(team: Team, asked: Sequence[tuple[str, Sequence[int]]], *, limit: int) -> dict[str, Any]:
    """Return a team, and what it does in the states that were asked for, as plain values."""
    from fireworld.policy.inspection import choice, summarize

    n_tables, n_states, _ = team.tables.shape
    rows = [state for _, found in asked for state in _rows_of(found, n_states)[:limit]]
    return {
        "digest": team.digest,
        "n_tables": n_tables,
        "n_states": n_states,
        "provenance": short_provenance(team),
        "tables": [{"n_visited": summary.n_visited, "n_by_action": summary.n_by_action} for summary in summarize(team)],
        "states": [
            _choice_as_json(choice(team, table=table, state=state)) for state in rows for table in range(n_tables)
        ],
    }


def short_provenance(team: Team | Ranking) -> dict[str, Any]:
    """Return where a team comes from, the curriculum by its name and digest alone."""
    origin = {key: value for key, value in team.provenance.items() if key != "curriculum"}
    curriculum = team.provenance.get("curriculum")
    if isinstance(curriculum, dict):
        origin["curriculum"] = {key: curriculum.get(key) for key in ("name", "digest")}
    return origin


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


def difference_as_json(difference: TeamDifference, *, limit: int) -> dict[str, Any]:
    """Return what differs as plain values."""
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
