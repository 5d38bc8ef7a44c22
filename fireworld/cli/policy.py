"""`fireworld policy`: the policies there are, what a trained team does and why, and how two teams differ."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fireworld.cli.compiling import announce_compilation
from fireworld.cli.progress import bar
from fireworld.cli.tables import print_blocks, print_table

if TYPE_CHECKING:
    from fireworld.policy.teams.team import Team

HISTORIES_MAX = 12
"""States at most whose histories are shown at a time."""
SHOWN_OPTION = click.option(
    "--limit",
    default=20,
    show_default=True,
    type=click.IntRange(min=1),
    metavar="N",
    help="List N states, or weights that differ, at most.",
)
OUTPUT_OPTION = click.option(
    "-o", "--output", metavar="TEAM.npz", required=True, type=click.Path(path_type=Path), help="Team file to write."
)


@click.group()
def command() -> None:
    """List the policies; show what a team does and why, how two differ; import a network, take the mean of several.

    A team is a team file, or the name of a team that comes with fireworld.
    """


@command.command("list")
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
def list_policies(*, as_json: bool) -> None:
    """List the policies that come with fireworld: rules, teams that learned, and the planner.

    Your own are named FILE.py:CLASS or MODULE:CLASS.
    """
    from fireworld.policy.names import policies

    known = policies()
    if as_json:
        click.echo(json.dumps([one._asdict() for one in known], indent=2))
    else:
        print_table(["name", "kind", "what it does"], known, left=(0, 1, 2), whole=(0, 1))


@command.command()
@click.argument("team", metavar="TEAM")
@click.argument("states", metavar="[STATE]...", nargs=-1)
@click.option(
    "--log",
    metavar="F.mcap",
    type=click.Path(path_type=Path),
    help="The training log that the team came of: show how values of STATEs came about; with --step, a run.",
)
@click.option(
    "--step",
    metavar="N",
    type=click.IntRange(min=1),
    help="A step of the run in --log: show why each brigade preferred its target.",
)
@SHOWN_OPTION
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
def show(*, team: str, states: tuple[str, ...], log: Path | None, step: int | None, limit: int, as_json: bool) -> None:
    """Show what a team does: how much it has seen, what it prefers, and in each STATE what it does and why.

    A STATE is its number in recordings, 0 to 4319, or some of its features; then all states that have them are meant,
    and those visited in training are listed. A team that ranks targets has no states: its weights are listed, and what
    they come to in words; "above all" means weights of at least half the largest one, "also" of a fifth, "a little" of
    a twentieth. A team with a network has no states either: its layers are listed, and what it reads.

    \b
    fireworld policy show team.npz
    fireworld policy show team.npz 1193
    fireworld policy show team.npz free_edges=3,volume=high,distance_from_civilian=low
    fireworld policy show paper-cooperative
    fireworld policy show team.npz 1193 --log team.mcap
    fireworld policy show best --log run.mcap --step 12

    With --log, the training log that the team came of: when each brigade was first in the state, its values at the end
    of every scenario, and the steps that moved them most. With --log and --step, a run and a step of it: what each
    brigade went for, what the team values most of all else, and what each feature adds to the difference.

    Exit code: 0 shown, 2 no such team, state or step, or a log of another team.
    """
    from fireworld.policy.teams.team import load_team

    loaded = load_team(team)
    if step is not None:
        _show_step(loaded, states, log, step, limit=limit, as_json=as_json)
        return
    if log is not None:
        _show_history(loaded, team, states, log, limit=limit, as_json=as_json)
        return
    if as_json:
        click.echo(json.dumps(loaded.as_dict(states=states, limit=limit), indent=2))
        return
    blocks = [*loaded.describe(states=states, limit=limit)]
    print_blocks([f"{team}: {blocks[0]}", *blocks[1:]])


@command.command()
@click.argument("first", metavar="A")
@click.argument("second", metavar="B")
@click.option("--actions-only", is_flag=True, help="Other values that lead to the same actions are no difference.")
@SHOWN_OPTION
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.pass_context
def diff(context: click.Context, *, first: str, second: str, actions_only: bool, limit: int, as_json: bool) -> None:
    """Compare team B with team A: in which states which brigade would act differently.

    Of two teams that rank targets, the weights that differ are listed; of two networks, the layers.

    \b
    fireworld policy diff team.npz paper-cooperative

    Exit code: 0 the same, 1 different, 2 could not compare.
    """
    from fireworld.policy.teams.team import compare_teams, load_team

    a, b = load_team(first), load_team(second)
    difference = compare_teams(a, b, names=(first, second))
    same = difference.same_actions if actions_only else difference.same
    if as_json:
        details = difference.as_dict(limit=limit)
        click.echo(json.dumps({"same": same, "digests": [a.digest, b.digest], **details}, indent=2))
    else:
        print_blocks(difference.describe(limit=limit))
    context.exit(0 if same else 1)


@command.command("import")
@click.argument("model", metavar="NET.onnx", type=click.Path(path_type=Path))
@OUTPUT_OPTION
@click.option("--features", metavar="NAME,...", help="What its inputs are.  [default: the 13 features of a target]")
@click.option("--own-targets", is_flag=True, help="Value all burning buildings of the site, not only the four named.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def import_network(*, model: Path, output: Path, features: str | None, own_targets: bool, force: bool) -> None:
    """Make a team of a network in an ONNX model, by which all brigades value targets.

    The model has one input, the features of targets in the order of docs/model.md, section 7, and one output, the
    value; it consists of Gemm or MatMul and Add, with Relu or Tanh between them. Reading it needs the package onnx:
    pip install 'fireworld[onnx]'.

    \b
    fireworld policy import net.onnx -o team.npz
    fireworld run test-2 --policy team.npz

    Exit code: 0 written, 2 no such model, or one with something else in it.
    """
    from fireworld.files import check_outputs
    from fireworld.policy.teams.network_layers import FEATURES
    from fireworld.policy.teams.network_team import NetworkTeam

    check_outputs([output], force=force, inputs=[model])
    reads = FEATURES if features is None else [name.strip() for name in features.split(",")]
    team = NetworkTeam.from_onnx(model, features=reads, own_targets=own_targets)
    _write(team, output, force=force)


@command.command()
@click.argument("teams", metavar="TEAM...", nargs=-1, required=True)
@OUTPUT_OPTION
@click.option("--force", is_flag=True, help="Replace an existing file.")
def mean(*, teams: tuple[str, ...], output: Path, force: bool) -> None:
    """Make a team of several networks, which values a target by the mean of what they value it by.

    Trainings of one method differ by chance, and their mean has less of it. It is one network, whose hidden layers have
    the units of all, so it takes as long as all of them. The networks read the same features, with the same
    activations. Values count as they are: a network whose values are farther apart has more say.

    \b
    fireworld train --method targets --repetitions 3 -o t.npz
    fireworld policy mean t-1.npz t-2.npz t-3.npz -o mean.npz
    fireworld compare t-1.npz mean.npz --scenarios contested

    Exit code: 0 written, 2 there is no such mean.
    """
    from fireworld.files import check_outputs
    from fireworld.policy.teams.network_team import NetworkTeam
    from fireworld.policy.teams.team import load_team

    check_outputs([output], force=force, inputs=[Path(team) for team in teams])
    team = NetworkTeam.mean_of([load_team(team) for team in teams], names=teams)
    _write(team, output, force=force)


def _write(team: Team, output: Path, *, force: bool) -> None:
    """Write a team file, and say what it is."""
    team.save(output, force=force)
    click.echo(f"{output}: {team.summary}, digest {team.digest[:12]}")


def _show_step(team: Team, states: tuple[str, ...], path: Path | None, step: int, *, limit: int, as_json: bool) -> None:
    """Show why brigades preferred their targets in a step of a run."""
    if path is None or states:
        raise click.UsageError("--step needs --log with a run, and no STATE.")
    announce_compilation()
    from fireworld.recording.explanation.preference import preferences

    found = preferences(team, path, step=step)
    if as_json:
        click.echo(json.dumps(found.as_dict(), indent=2))
    else:
        print_blocks(found.describe(limit=limit))


def _show_history(team: Team, name: str, states: tuple[str, ...], path: Path, *, limit: int, as_json: bool) -> None:
    """Show how the values of states came about in a training."""
    if not states:
        raise click.UsageError("--log needs a STATE, or --step with a run.")
    announce_compilation()
    from fireworld.policy.words import find_states
    from fireworld.training.log.history import state_histories
    from fireworld.training.log.reader import open_training
    from fireworld.training.log.verify import check_team

    found = list(dict.fromkeys(state for text in states for state in find_states(text)))
    if len(found) > HISTORIES_MAX:
        raise click.UsageError(f"--log: expected at most {HISTORIES_MAX} states, got {len(found)}: name more features.")
    log = open_training(path, partial=True)
    check_team(log, team, source=name)
    with bar("reading", len(log), quiet=as_json) as advance:
        histories = state_histories(log, found, on_part=advance)
    if as_json:
        click.echo(json.dumps([one.to_dict() for one in histories], indent=2))
        return
    for one in histories:
        print_blocks([*one.describe(limit=limit), ""])
