"""A word before the first-ever compilation, which takes a while."""

from __future__ import annotations

import click


def announce_compilation() -> None:
    """Say what is happening if the kernels are not compiled yet on this machine."""
    from fireworld import kernels

    if kernels.is_cold():
        click.echo("compiling the simulator for this machine, once; this takes about 15 seconds ...", err=True)
