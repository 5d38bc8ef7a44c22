"""Run all checks and print a table."""

from __future__ import annotations

import json
import sys

import click

from fireworld import envs
from fireworld.errors import FireworldError

FAILURE, ERROR = 1, 2


@click.command()
@click.option("--scenario", default="quick", show_default=True, help="What is played: a shipped name or a YAML file.")
@click.option("--no-benchmark", is_flag=True, help="Leave out PettingZoo's measurement, which takes five seconds.")
@click.option("--json", "as_json", is_flag=True, help="Write the results as JSON.")
def main(*, scenario: str, no_benchmark: bool, as_json: bool) -> None:
    """Do all forms of environments keep what their libraries, and fireworld, promise?

    Exit code: 0 yes, 1 no, 2 could not be checked.
    """
    try:
        for name in ("team", "brigade"):
            getattr(envs, name)  # its error names the extra, where that is missing
        from fireworld.envs.check.checks import run_check, table_of
        from fireworld.envs.check.everything import checks_of

        found = [run_check(check) for check in checks_of(scenario, benchmark=not no_benchmark)]
    except FireworldError as error:
        click.echo(f"fireworld.envs.check: {error}", err=True)
        sys.exit(ERROR)
    ok = all(one.ok for one in found)
    click.echo(json.dumps([one.to_dict() for one in found], indent=2) if as_json else table_of(found))
    sys.exit(0 if ok else FAILURE)


main(prog_name="python -m fireworld.envs.check")
