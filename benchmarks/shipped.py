"""The trained teams that come with fireworld: train them again by the documented commands, compare or replace them.

`python -m benchmarks.shipped` trains each anew and prints whether it is the shipped one; `--write` puts what was
trained in its place. With names it is these: `best` takes more than an hour on two cores, `sarsa` four minutes
of one, all others together a minute.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import click

from fireworld.errors import TrainingError
from fireworld.policy.teams import team_path
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.teams.team import Team, load_team
from fireworld.training.training import check_same

COMMANDS: Final[Mapping[str, tuple[str, ...]]] = {
    "paper-cooperative": ("train", "paper", "--seed", "1"),
    "paper-noncooperative": ("train", "paper", "--stages", "alone", "--seed", "1"),
    "best-2026": ("train", "contested", "--method", "search", "--seed", "1"),
    "sarsa": ("train", "contested", "--method", "targets", "--seed", "1"),
    "best": ("train", "conditions", "--method", "rollouts", "--seed", "2026"),
}
"""How each team is trained: the words after `fireworld`, `-o TEAM.npz` apart."""


def train_all(folder: Path, names: Sequence[str] = tuple(COMMANDS)) -> dict[str, Team]:
    """Train teams by their commands, side by side; files go to the folder."""
    program = [sys.executable, "-c", "from fireworld.cli import main; main()"]
    started = {
        name: subprocess.Popen(
            [*program, *words, "-o", f"{name}.npz"], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        for name, words in COMMANDS.items()
        if name in names
    }
    for name, process in started.items():
        if process.wait() != 0:
            raise click.ClickException(f"{name}: fireworld {' '.join(COMMANDS[name])}: exit code {process.returncode}")
    return {name: load_team(folder / f"{name}.npz") for name in started}


def same(team: Team, shipped: Team) -> bool:
    """Return whether a team has learned what a shipped one has, from the same; the version may be another."""
    origin = {key: value for key, value in team.provenance.items() if key != "fireworld"}
    try:
        check_same(shipped.provenance, origin, Path())
    except TrainingError:
        return False
    if isinstance(team, TableTeam) and isinstance(shipped, TableTeam) and (team.visits != shipped.visits).any():
        return False
    return team.digest == shipped.digest


@click.command()
@click.argument("names", metavar="[NAME]...", nargs=-1, type=click.Choice([*COMMANDS]))
@click.option("--write", is_flag=True, help="Replace the shipped teams by those trained now, where they differ.")
@click.pass_context
def main(context: click.Context, *, names: tuple[str, ...], write: bool) -> None:
    """Train the shipped teams again, or those named; exit code 1 if one comes out differently."""
    n_others = 0
    with TemporaryDirectory() as folder:
        for name, team in train_all(Path(folder), names or tuple(COMMANDS)).items():
            path = team_path(name)
            unchanged = path.is_file() and same(team, load_team(path))
            if not unchanged and write:
                shutil.copy(Path(folder) / path.name, path)
            n_others += not (unchanged or write)
            click.echo(f"{name}: {'the same' if unchanged else 'written' if write else 'ANOTHER'}, {team.digest}")
    context.exit(1 if n_others else 0)


if __name__ == "__main__":
    main()
