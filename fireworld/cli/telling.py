"""What commands tell CI servers of what they found: a summary in Markdown, and annotations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from fireworld.findings import Finding

Command = TypeVar("Command", bound=Callable[..., Any])


def telling_options(command: Command) -> Command:
    """Add --summary and --annotate to a command."""
    summary = click.option(
        "--summary", metavar="FILE.md", type=click.Path(path_type=Path, dir_okay=False),
        help="Write what is different, and why, as Markdown; pictures go to FILE-files.",
    )  # fmt: skip
    annotate = click.option(
        "--annotate", type=click.Choice(["github"]), help="Print annotations for a CI server, if anything is different."
    )
    return summary(annotate(command))


def check_telling(*, annotate: str | None, as_json: bool) -> None:
    """Check that annotations do not get into JSON."""
    if annotate and as_json:
        raise click.UsageError("--annotate and --json exclude each other.")


def tell(
    findings: Sequence[Finding],
    title: str,
    *,
    summary: Path | None,
    annotate: str | None,
    cannot: str = "error",
) -> None:
    """Write the summary and print the annotations, if they were asked for.

    Args:
        findings: what was found.
        title: of the summary.
        summary: the file; whether it may be written has been checked.
        annotate: for which server, or None.
        cannot: level of annotations of what cannot be told.
    """
    if summary is not None:
        from fireworld.files import write_file
        from fireworld.markdown import markdown_page

        write_file(summary, markdown_page(title, findings, beside=summary.parent))
    if annotate:
        from fireworld.annotations import annotation_lines

        for line in annotation_lines(findings, cannot=cannot):
            click.echo(line)


def files_beside(summary: Path) -> Path:
    """Return the folder of a summary's pictures and pages."""
    return summary.with_name(f"{summary.stem}-files")
