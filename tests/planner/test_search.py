"""The climb from a few assignments to one that no brigade can better alone."""

from __future__ import annotations

from itertools import product

from hypothesis import given
from hypothesis import strategies as st

from fireworld.draws import uniform
from fireworld.planning.planner import FOLLOW, climb, option_values, with_option

ASSIGNMENTS = list(product(range(4), repeat=3))
UNIFORM = [(action,) * 3 for action in range(4)]


def hilly(seed, *, levels=0):
    """A value that is a keyed draw for each assignment; few levels make many ties."""

    def value(assignment):
        height = uniform(seed, 1, ASSIGNMENTS.index(assignment), 0)
        return float(int(height * levels)) if levels else height

    return value


def test_with_option():
    assert [with_option((0, 1, 2), brigade, 3) for brigade in range(3)] == [(3, 1, 2), (0, 3, 2), (0, 1, 3)]


def test_option_values():
    value = hilly(1)
    assert option_values(value, (3, 2, 1), 1) == {action: value((3, action, 1)) for action in range(4)}
    assert option_values(value, (3, 2, 1), 1, (2, 0)) == {2: value((3, 2, 1)), 0: value((3, 0, 1))}


@given(st.integers(0, 1000), st.sampled_from([0, 2, 4]))
def test_no_brigade_can_better_the_result_alone(seed, levels):
    value = hilly(seed, levels=levels)
    found = climb(value, UNIFORM)
    assert all(max(option_values(value, found, brigade).values()) == value(found) for brigade in range(3))
    assert value(found) >= max(map(value, UNIFORM))


@given(st.lists(st.lists(st.integers(-3, 3), min_size=4, max_size=4), min_size=1, max_size=7))
def test_it_finds_the_best_where_brigades_do_not_depend_on_each_other(worth):
    found = climb(lambda assignment: sum(worth[b][a] for b, a in enumerate(assignment)), [(2,) * len(worth)])
    assert [worth[brigade][action] for brigade, action in enumerate(found)] == [max(row) for row in worth]


def level(assignment):
    return 0.0


def test_ties_go_to_the_lowest():
    assert climb(level, reversed(UNIFORM)) == (0, 0, 0)
    assert climb(level, [(2, 1, 0), (1, 3, 3)]) == (1, 3, 3)
    assert climb(lambda assignment: float(assignment[1] > 1), [(3, 1, 3)]) == (3, 2, 3)


def test_the_order_of_the_starts_does_not_matter():
    for seed in range(50):
        value = hilly(seed, levels=2)
        assert climb(value, UNIFORM) == climb(value, UNIFORM[::-1])


def test_it_asks_for_a_few_of_many_assignments():
    asked = set()

    def value(assignment):
        asked.add(assignment)
        return float(sum(assignment))

    assert climb(value, [(1,) * 10]) == (3,) * 10
    assert len(asked) <= 1 + 2 * 10 * 3  # of a million


def test_more_options_are_tried_and_ties_go_to_the_first():
    options = (FOLLOW, 0, 1, 2, 3)
    assert climb(level, [(2, 2), (FOLLOW, FOLLOW)], options) == (FOLLOW, FOLLOW)
    assert climb(lambda assignment: float(assignment.count(FOLLOW)), [(2, 2, 2)], options) == (FOLLOW,) * 3
    assert climb(lambda assignment: float(assignment[0] == 3), [(FOLLOW, FOLLOW)], options) == (3, FOLLOW)


def test_once_it_is_late_the_best_start_is_taken():
    assert climb(hilly(3), UNIFORM, is_late=lambda: True) == max(UNIFORM, key=hilly(3))
