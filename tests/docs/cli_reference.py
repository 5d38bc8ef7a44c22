"""The command-line reference docs/cli.md, made from the commands; `python -m tests.docs.cli_reference` renews it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import click

from fireworld.cli import root
from tests.docs.pages import ROOT

PAGE: Final = ROOT / "docs" / "cli.md"
WIDTH: Final = 100
HEAD: Final = """\
# The command line

This page is what every command says with `--help`; `make docs` renews it.

Results go to standard output, progress and complaints to standard error. Whatever is wrong with a file or a flag takes
one line. Exit codes: 0 done, 1 done and the answer is no (recordings differ, a recording is damaged, a trace is not
met), 2 could not be done, 130 interrupted.

The tab key completes commands and options, once the shell knows how. One of these lines in the shell's own file does
it: `~/.bashrc`, `~/.zshrc`, `~/.config/fish/completions/fireworld.fish`.

<!-- not run: each is for another shell; tests/docs/test_project.py calls them -->
```sh
eval "$(_FIREWORLD_COMPLETE=bash_source fireworld)"
eval "$(_FIREWORLD_COMPLETE=zsh_source fireworld)"
_FIREWORLD_COMPLETE=fish_source fireworld | source
```
"""


def commands() -> Iterator[tuple[click.Context, click.Command]]:
    """Yield every command with its context: the root, then each command followed by those below it."""
    context = click.Context(root, info_name="fireworld", terminal_width=WIDTH, **root.context_settings)
    yield from _with_those_below(root, context)


def command_reference() -> str:
    """Return the whole page."""
    sections = [_section(context.command_path, command.get_help(context)) for context, command in commands()]
    return "\n".join([HEAD, *sections])


def _section(title: str, text: str) -> str:
    return f"## {title}\n\n```text\n{text}\n```\n"


def _with_those_below(command: click.Command, context: click.Context) -> Iterator[tuple[click.Context, click.Command]]:
    yield context, command
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None, name
            yield from _with_those_below(below, click.Context(below, info_name=name, parent=context))


if __name__ == "__main__":
    PAGE.write_text(command_reference(), encoding="utf-8")
