"""Parameters behind a policy's name: what is read, what is written reads back, and every mistake in one line."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fireworld.errors import PolicyError
from fireworld.policy.parameter_text import check_plain, check_signature, read_parameters, write_parameters


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("", {}),
        ("k=3", {"k": 3}),
        ("k=-3,near=true,far=false,none=null", {"k": -3, "near": True, "far": False, "none": None}),
        ("a=0.5,b=1e-3,c=.5,d=007", {"a": 0.5, "b": 0.001, "c": 0.5, "d": "007"}),
        (
            "name=north,path=data/x.npz,url=http://a:80/b",
            {"name": "north", "path": "data/x.npz", "url": "http://a:80/b"},
        ),
        ("yes=yes,on=on", {"yes": "yes", "on": "on"}),
        ("a='b, c=d',e=\"f\\n,\"", {"a": "b, c=d", "e": "f\n,"}),
        ("a='it''s',b='3'", {"a": "it's", "b": "3"}),
        ("a=[1, 2.5, x],b=[],c=[[1, 2], ['],']]", {"a": [1, 2.5, "x"], "b": [], "c": [[1, 2], ["],"]]}),
        ("k=,l= 4 ", {"k": "", "l": 4}),
        ("a=b=c", {"a": "b=c"}),
        ("k=__import__('os').getcwd()", {"k": "__import__('os').getcwd()"}),
    ],
)
def test_values_are_literals(text, values):
    found = read_parameters(text, where="mine:A")
    assert found == values
    assert [type(value) for value in found.values()] == [type(value) for value in values.values()]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("k", "^mine:A: expected parameters as in k=3,near=true, got 'k'$"),
        ("k=3,", "got 'k=3,'$"),
        ("k=3,,l=4", "got 'k=3,,l=4'|got ',l=4'"),
        ("=3", "got '=3'"),
        ("2k=3", "got '2k=3'"),
        ("k.l=3", "got 'k.l=3'"),
        ("k=3,k=4", "^mine:A: expected every parameter once, got k twice$"),
        ("k='open", 'got "k=\'open"'),
        ("k=[1, 2", "got k=.1, 2"),
        ("k=it's", 'got "k=it\'s"'),
        ("k={a: 1}", "^mine:A: k: expected a number, text, true, false, null or a list of these, got {a: 1}$"),
        ("k=!!python/object/apply:os.system [echo]", "^mine:A: k: line 1, .*: expected values without tags"),
        ("k=&a", "^mine:A: k: "),
        ("k=@x", "^mine:A: k: .*expected YAML"),
    ],
)
def test_what_is_no_parameter(text, message):
    with pytest.raises(PolicyError, match=message) as caught:
        read_parameters(text, where="mine:A")
    assert "\n" not in str(caught.value)


NAMES = st.from_regex(r"[a-z_][a-z_0-9]{0,8}", fullmatch=True)
PLAIN = st.none() | st.booleans() | st.integers(-(10**17), 10**17) | st.floats(allow_nan=False, allow_infinity=False)
TEXT = st.text(st.characters(codec="utf-8", exclude_categories=["Cs", "Cc"]), max_size=12)


@given(st.dictionaries(NAMES, PLAIN | TEXT | st.lists(PLAIN | TEXT, max_size=4), max_size=4))
def test_what_is_written_reads_back(values):
    assert read_parameters(write_parameters(values), where="mine:A") == values


def test_how_it_is_written():
    written = write_parameters({"k": 3, "near": True, "name": "a b", "to": "x.npz", "w": [1, "b"], "n": None, "t": "3"})
    assert written == 'k=3,near=true,name="a b",to=x.npz,w=[1, b],n=null,t="3"'


@pytest.mark.parametrize("value", [object(), {"a": 1}, {1}, float("nan"), float("inf"), [object()], b"x", 1j])
def test_values_from_python_are_plain(value):
    with pytest.raises(PolicyError, match=r"^mine:A: k: expected a plain value .*; give the policy as an object$"):
        check_plain({"k": value}, where="mine:A")
    with pytest.raises(PolicyError, match=r"^mine:A: expected names of parameters, got a b$"):
        check_plain({"a b": 1}, where="mine:A")
    assert check_plain({"k": (1, (2, 3))}, where="mine:A") == {"k": [1, [2, 3]]}


def takes_some(k, near=True, *, far=1): ...


def takes_any(**more): ...


class Nothing: ...


@pytest.mark.parametrize(
    ("target", "parameters", "message"),
    [
        (takes_some, {"k": 1, "nera": 2}, "^x: expected parameters k, near, far, got 'nera'; try near$"),
        (takes_some, {"near": 2}, "^x: expected a value for k, as in k=VALUE, got 'none'$"),
        (Nothing, {"k": 1}, "^x: expected no parameters, got 'k'$"),
    ],
)
def test_what_a_signature_does_not_take(target, parameters, message):
    with pytest.raises(PolicyError, match=message):
        check_signature(target, parameters, where="x")


@pytest.mark.parametrize(
    ("target", "parameters"), [(takes_some, {"k": 1, "far": 2}), (takes_any, {"k": 1}), (Nothing, {}), (dict.get, {})]
)
def test_what_a_signature_takes(target, parameters):
    check_signature(target, parameters, where="x")
