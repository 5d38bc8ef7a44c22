"""Tables: columns to the left or right, cells folded or whole."""

from __future__ import annotations

from fireworld.cli.tables import print_table

HEAD, ROWS = ("name", "n", "what"), [("long name", "1", "a b"), ("b", "22", "[c]")]


def lines(capsys, **changes):
    print_table(HEAD, ROWS, **changes)
    return [line.rstrip() for line in capsys.readouterr().out.splitlines()]


def test_the_first_column_stands_left(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert lines(capsys) == [
        "name         n   what",
        "─────────────────────",
        "long name    1    a b",
        "b           22    [c]",
    ]


def test_other_columns_on_the_left_and_close_together(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert lines(capsys, left=(2,), narrow=True) == [
        "     name  n what",
        "─────────────────",
        "long name  1 a b",
        "        b 22 [c]",
    ]


def test_what_does_not_fit_is_folded_and_nothing_is_lost(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "19")
    folded = lines(capsys)
    assert "long name    1    a b" not in folded
    whole = lines(capsys, whole=(0,))
    assert any(line.startswith("long name") for line in whole)
    for found in (folded, whole):
        letters = "".join(found).replace(" ", "").replace("─", "")
        assert sorted(letters) == sorted("".join([*HEAD, *ROWS[0], *ROWS[1]]).replace(" ", ""))
