"""The README: its targets exist, and it is short."""

import re

from tests.docs.pages import README, ROOT, code

LINES_MAX = 250


def test_its_make_targets_exist():
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    named = {line.split()[1] for line in code(README) if line.startswith("make ")}
    assert {"demo", "test"} <= named
    assert named <= targets


def test_it_is_short_and_begins_with_a_picture():
    lines = README.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= LINES_MAX
    assert lines[0].startswith("![")
