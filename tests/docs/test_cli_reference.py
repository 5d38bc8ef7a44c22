"""The reference of the command line: current, and every command and option explained."""

import click
import pytest

from fireworld.cli import COMMANDS
from tests.docs import cli_reference as reference

FOUND = {context.command_path: command for context, command in reference.commands()}


def test_the_page_is_current():
    assert reference.PAGE.read_text(encoding="utf-8") == reference.command_reference(), "run `make docs`"


def test_every_command_is_there():
    assert {f"fireworld {name}" for name in COMMANDS} <= set(FOUND)


@pytest.mark.parametrize("path", FOUND)
def test_every_command_and_option_has_help(path):
    command = FOUND[path]
    assert command.help
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert parameter.help, f"{path} {parameter.opts[-1]}"
