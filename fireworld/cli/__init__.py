"""The command line: one module per command, imported only when its command is called."""

from __future__ import annotations

import importlib
import os
import sys
from typing import Final, NoReturn

import click

USER_ERROR: Final = 2
INTERRUPTED: Final = 130

COMMANDS: Final = {
    "run": "Run a scenario and record it.",
    "train": "Train a team, or several.",
    "policy": "List policies; show what a team does, or how two differ.",
    "reproduce": "Repeat the paper: its tables beside ours.",
    "scenarios": "List and draw scenarios; is a fire contested? Find one.",
    "city": "Import, export and draw cities of real maps.",
    "info": "Show what a recording holds and how far it is good.",
    "compare": "Compare two policies run by run, with a verdict.",
    "leaderboard": "Rank policies in suites of scenarios that nobody learned in.",
    "diff": "Compare two recordings step by step.",
    "fork": "Branch off from a recorded step.",
    "explain": "Find the decisions that made one run better than another.",
    "replay": "Write an episode of a training as the log of a run.",
    "verify": "Replay a recording and compare every step.",
    "export": "Write a recording as tables, or several as a dataset.",
    "golden": "Run golden recordings again and compare.",
    "import-log": "Make a recording of an official kernel's log.",
    "recover": "Rescue the committed steps of a damaged recording.",
    "view": "Open recordings in Rerun.",
    "play": "Write a recording, or two, as a page that plays.",
    "render": "Draw recordings: pictures, strips, films.",
    "report": "Write a recording, or two, as an HTML page.",
    "conformance": "Check the fire model against traces of another simulator.",
}
DEBUG: Final = click.Option(["--debug"], is_flag=True, expose_value=False, help="Show the traceback of an error.")


class LazyGroup(click.Group):
    """A group that knows its commands' names and summaries without importing them."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Name the commands in the order a newcomer needs them."""
        del ctx
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the module of one command."""
        del ctx
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f"fireworld.cli.{cmd_name.replace('-', '_')}")
        return _with_debug(module.command)

    def invoke(self, ctx: click.Context) -> object:
        """Run a command; one that was interrupted says itself what is left of its work."""
        from fireworld.interrupt import Interrupted

        try:
            return super().invoke(ctx)
        except Interrupted as error:
            click.echo(str(error), err=True)
            return INTERRUPTED

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands from the table, so that --help imports none of them."""
        del ctx
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Start with `fireworld run --record out.mcap`, then `fireworld view out.mcap`.",
)
@click.version_option(package_name="fireworld")
def root() -> None:
    """Run, record, view and compare teams of fire brigades."""


root.params.append(DEBUG)


def main() -> None:
    """Run the command line; an error ends in one line and exit code 2, one of fireworld's own too, Ctrl-C in 130."""
    from fireworld.errors import FireworldError, described
    from fireworld.interrupt import end_like_ctrl_c, was_interrupted
    from fireworld.stdout import StandardOutputError, be_patient

    try:
        end_like_ctrl_c()
        _say_what_is_ignored()
        be_patient()
        code = root.main(standalone_mode=False)
        if sys.stdout is not None:
            sys.stdout.flush()
    except FireworldError as error:
        code = _show(error, str(error))
    except click.ClickException as error:
        error.show()
        code = error.exit_code
    except (click.Abort, KeyboardInterrupt):
        click.echo("interrupted", err=True)
        code = INTERRUPTED
    except StandardOutputError as error:
        code = _show(error, f"standard output: cannot be written: {error}")
    except OSError as error:  # of a file that somebody named: its name is too long, say
        code = _show(error, _of_a_file(error) or f"internal error: {described(error)}; run it again with --debug")
    except BaseException as error:
        if isinstance(error, SystemExit) and "_FIREWORLD_COMPLETE" in os.environ:
            raise
        if was_interrupted(error):
            click.echo("interrupted", err=True)
            code = INTERRUPTED
        else:
            code = _show(error, f"internal error: {described(error)}; run it again with --debug")
    _end(code)


def _end(code: int) -> NoReturn:
    """End the program, whose work is done: a Ctrl-C that comes now is too late."""
    from fireworld.interrupt import no_more
    from fireworld.stdout import leave

    try:
        no_more()
        leave()
    except KeyboardInterrupt:
        leave()
    sys.exit(code)


def _say_what_is_ignored() -> None:
    """Let what users' code raises in threads and finalizers, where nobody catches it, be a line too."""
    import threading

    from fireworld.errors import described
    from fireworld.interrupt import once_more

    def warn(error: BaseException | None, where: str) -> None:
        if isinstance(error, KeyboardInterrupt):
            once_more()
        elif error is not None and not isinstance(error, SystemExit):
            _trace(error)
            click.echo(f"warning: what {where} raised is ignored: {described(error)}", err=True)

    if sys.unraisablehook is sys.__unraisablehook__:
        sys.unraisablehook = lambda fault: warn(fault.exc_value, "a finalizer")
    if threading.excepthook is threading.__excepthook__:
        threading.excepthook = lambda fault: warn(fault.exc_value, "a thread")


def _of_a_file(error: OSError) -> str:
    """Return the line of a file's error, "" if it is not a file's."""
    from fireworld.errors import one_line

    if not isinstance(error.filename, str | bytes | os.PathLike):
        return ""
    return one_line(f"{os.fsdecode(error.filename)}: {error.strerror}; try another name or folder")


def _show(error: BaseException, line: str) -> int:
    """Write the line of an error, with --debug also its traceback; return the exit code."""
    _trace(error)
    click.echo(f"fireworld: {line}", err=True)
    return USER_ERROR


def _trace(error: BaseException) -> None:
    """Write the traceback of an error, if it is asked for."""
    if "--debug" in sys.argv or os.environ.get("FIREWORLD_DEBUG", "0") not in {"", "0"}:
        import traceback

        traceback.print_exception(error)


def _with_debug(command: click.Command) -> click.Command:
    """Let a command, and those below it, take --debug."""
    if DEBUG not in command.params:
        command.params.append(DEBUG)
    if isinstance(command, click.Group):
        for below in command.commands.values():
            _with_debug(below)
    return command
