"""Is a file whole, where its bytes may differ from call to call; and a reproduction that takes a moment."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from fireworld_recorder.reader import open_log

from fireworld.errors import FireworldError


def run_up_to(path: Path) -> str:
    """Return what is wrong with the log of a run that was perhaps interrupted; empty if it is complete."""
    try:
        log = open_log(path)
    except FireworldError as error:
        return str(error)
    return "" if log.state == "complete" and len(log) else "it holds no steps"


def is_beginning(path: Path, whole: Path) -> bool:
    """Return whether a log holds the first steps of another."""
    a, b = open_log(path), open_log(whole, partial=True)
    steps = [[(topic, bytes(data)) for topic, data in raw] for raw in a.raw_steps()]
    return steps == [[(topic, bytes(data)) for topic, data in raw] for raw in b.raw_steps()][: len(steps)]


def lines(path: Path) -> str:
    """Return what is wrong with a table of lines: the last one is cut."""
    data = path.read_bytes()
    if path.suffix != ".csv":
        return "its bytes are not those of a whole call"
    n_cells = {line.count(b",") for line in data.splitlines()}
    return "" if data.endswith(b"\n") and len(n_cells) == 1 else "a line of it is cut"


def results(path: Path) -> str:
    """Return what is wrong with a file of results."""
    from fireworld.evaluation.results import read_results

    try:
        read_results(path)
    except FireworldError as error:
        return str(error)
    return ""


def golden(path: Path) -> str:
    """Return what is wrong with a file of a folder of goldens."""
    if path.suffix == ".mcap":
        return run_up_to(path)
    text = path.read_text("utf-8")
    return "" if text.endswith("\n") else "its last line is cut"


def checked(path: Path) -> str:
    """Return what is wrong with what a check of goldens writes: its JUnit file, or a new run."""
    if path.suffix == ".mcap":
        return run_up_to(path)
    try:
        ElementTree.parse(path)
    except ElementTree.ParseError as error:
        return str(error)
    return ""


def rrd(path: Path) -> str:
    """Return what is wrong with a file of Rerun: its end."""
    data = path.read_bytes()
    return "" if data[:4] in {b"RRF2", b"RRIO"} and b"RRF2" in data[-64:] else f"it ends in {data[-16:]!r}"


def reproduction(path: Path) -> str:
    """Return what is wrong with a file of a reproduction."""
    if path.suffix in {".html", ".csv", ".json"}:
        text = path.read_text("utf-8").rstrip()
        end = {".html": "</html>", ".json": "}"}.get(path.suffix, "")
        return "" if text.endswith(end) else "its end is missing"
    if path.suffix == ".mcap":
        return run_up_to(path)
    return "" if path.stat().st_size else "it is empty"


def small_paper() -> None:
    """Let this process reproduce a paper whose every scenario is a small town."""
    from fireworld.reproduction import reproduce
    from tests.evaluation.test_reproduce import CURRICULUM, METHOD, make_paper_small

    Path("small.yaml").write_text(CURRICULUM)
    reproduce.CURRICULUM, reproduce.PAPER = Path("small.yaml"), METHOD  # type: ignore[misc, assignment]
    make_paper_small()
