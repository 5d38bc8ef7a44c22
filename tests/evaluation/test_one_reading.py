"""One reading of the paper, named by the levels of its choices."""

from __future__ import annotations

import click
import pytest

from benchmarks.one_reading import levels_of


def test_words_name_levels_of_choices():
    assert levels_of(["duration=four-steps", "pumps=litres-5000"]) == {"duration": "four-steps", "pumps": "litres-5000"}
    for word, wanted in (
        ("pump=litres-5000", "one of epsilon, "),
        ("pumps=5000", "one of litres-2000, "),
        ("pumps", "after ="),
    ):
        with pytest.raises(click.UsageError, match=wanted):
            levels_of([word])
