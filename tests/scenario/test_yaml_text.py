"""Strict YAML: what is text stays text, what could mean two things is refused, all in one line."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fireworld.errors import ScenarioError
from fireworld.scenario.yaml_text import read_yaml, write_yaml


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("7", 7),
        ("-0", 0),
        ("+5", 5),
        ("1.5", 1.5),
        (".5", 0.5),
        ("1e3", 1000.0),
        ("1.e-2", 0.01),
        ("true", True),
        ("null", None),
        ("~", None),
        ("", None),
        # YAML 1.1 would make these false, true, eight, 750, a date, infinity, 1000 and sixteen.
        ("no", "no"),
        ("Yes", "Yes"),
        ("010", "010"),
        ("12:30", "12:30"),
        ("2012-06-18", "2012-06-18"),
        (".inf", ".inf"),
        ("1_000", "1_000"),
        ("0x10", "0x10"),
        ("1e999", "1e999"),
        ("'7'", "7"),
    ],
)
def test_words_mean_what_they_look_like(text, value):
    read = read_yaml(f"key: {text}", source="a.yaml")["key"]
    assert (read, type(read)) == (value, type(value))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: 2\na: 3", "a.yaml: line 3, column 1: expected each key once, got 'a' a second time"),
        ("a: {b: 1, b: 2}", "a.yaml: line 1, column 11: expected each key once, got 'b' a second time"),
        ("a: &x 1", "a.yaml: line 1, column 4: expected every value written out, got the anchor or alias x"),
        ("a: 1\nb: *x", "a.yaml: line 2, column 4: expected every value written out, got the anchor or alias x"),
        ("a: !!python/name:os x", "a.yaml: line 1, column 4: expected values without tags, got the tag tag:yaml.org"),
        ("1: 2", "a.yaml: line 1, column 1: expected a word as key, got '1'"),
        ("? [a]\n: 2", "a.yaml: line 1, column 3: expected a word as key, got"),
        ("a: [1", "a.yaml: line 1, column 6: expected YAML, got broken text ("),
        ("a: b: c", "a.yaml: line 1, column 5: expected YAML, got broken text (mapping values are not allowed here)"),
        ("a: 'x", "a.yaml: line 1, column 6: expected YAML, got broken text ("),
        ("--- 1\n--- 2", "a.yaml: line 2, column 1: expected YAML, got broken text ("),
        ("a: \x00", "a.yaml: expected YAML, got broken text ("),
        ("[" * 5000, "a.yaml: expected YAML, got nesting that is too deep"),
        (b"a: \xff", "a.yaml: expected UTF-8 text, got byte 0xff at 3"),
    ],
)
def test_what_is_refused_is_told_in_one_line(text, message):
    with pytest.raises(ScenarioError) as caught:
        read_yaml(text, source="a.yaml")
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


PLAIN = st.text(st.characters(codec="utf-8"), max_size=20)
VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**17), 10**17)
    | st.floats(allow_nan=False, allow_infinity=False)
    | PLAIN,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(PLAIN, inner, max_size=3),
    max_leaves=6,
)


@given(document=st.dictionaries(PLAIN, VALUES, max_size=4))
def test_what_is_written_is_read_back(document):
    assert read_yaml(write_yaml(document), source="a.yaml") == document


@given(text=st.text(alphabet="ab:{}[],- \n'\"&*!|>#%@?0.\t", max_size=40))
def test_any_text_is_read_or_refused(text):
    try:
        value = read_yaml(text, source="a.yaml")
    except ScenarioError as error:
        assert "\n" not in str(error)  # noqa: PT017 -- either outcome is right
    else:
        assert not isinstance(value, float) or math.isfinite(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (r'a: "\ud800"', "a.yaml: line 1, column 4: expected Unicode text, got half a surrogate pair"),
        (r'a: "\U00110000"', "a.yaml: expected YAML, got broken text (a number beyond all bounds)"),
        (r'a: "\Uffffffff"', "a.yaml: expected YAML, got broken text (a number beyond all bounds)"),
        ("%YAML " + "9" * 5000 + ".1\n--- 1", "a.yaml: expected YAML, got broken text (a number beyond all bounds)"),
    ],
)
def test_escapes_that_are_no_characters_are_refused(text, message):
    with pytest.raises(ScenarioError) as caught:
        read_yaml(text, source="a.yaml")
    assert str(caught.value) == message


def test_a_character_that_json_writes_as_two_escapes_is_one():
    assert read_yaml(r'"\ud83d\udd25"', source="a.yaml") == "\N{FIRE}"
