"""Strict YAML: the part of YAML 1.2 that a scenario needs, with one-line errors that name line and column.

PyYAML reads YAML 1.1, where `no` is false, `010` is eight and `12:30` is 750, and where a key written twice
silently wins. Here such words stay text (so that the type check names them), a key may be written once, and
anchors, aliases and tags are errors.
"""

from __future__ import annotations

import math
import re
from functools import partial
from typing import Any, Final

import yaml

from fireworld.errors import ScenarioError, expected

INTEGER: Final = re.compile(r"[-+]?(?:0|[1-9][0-9]{0,17})$")
FLOAT: Final = re.compile(r"[-+]?(?:\.[0-9]+|(?:0|[1-9][0-9]*)(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?$")
BOOLEAN: Final = re.compile(r"(?:true|false)$")
NULL: Final = re.compile(r"(?:null|~|)$")
N_VALUES_MAX: Final = 100_000
"""Of one document: far more than any scenario or curriculum says, and read within two seconds."""
CHARACTERS_MAX: Final = 1_000_000
CORE: Final = "tag:yaml.org,2002:"


class _ForbiddenError(yaml.MarkedYAMLError):
    """Good YAML that a scenario may not use."""

    def __init__(self, wanted: str, got: str, mark: yaml.Mark) -> None:
        super().__init__(problem=got, problem_mark=mark)
        self.wanted = wanted


class _Reader(yaml.SafeLoader):
    """PyYAML's safe loader with YAML 1.2 scalars, each key once, and nothing that refers to something else."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 -- PyYAML's own class attribute, filled below
    n_values = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Raise for aliases and anchors: a scenario has each thing once, where it belongs."""
        event = self.peek_event()  # type: ignore[no-untyped-call]  # the stubs leave it out
        if getattr(event, "anchor", None):
            raise _ForbiddenError("every value written out", f"the anchor or alias {event.anchor}", event.start_mark)
        if getattr(event, "tag", None):
            raise _ForbiddenError("values without tags", f"the tag {event.tag}", event.start_mark)
        self.n_values += 1
        if self.n_values > N_VALUES_MAX:
            raise _ForbiddenError(f"at most {N_VALUES_MAX} keys and values", "more of them", event.start_mark)
        return super().compose_node(parent, index)

    def construct_scalar(self, node: Any) -> Any:
        """Join characters that JSON writes as two escapes; raise for half of such a pair, which is no text."""
        text = super().construct_scalar(node)
        if text.isascii():
            return text
        try:
            return text.encode("utf-16", "surrogatepass").decode("utf-16")
        except UnicodeDecodeError:
            raise _ForbiddenError("Unicode text", "half a surrogate pair", node.start_mark) from None

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        """Raise for keys that are written twice, or are not text."""
        mapping: dict[Any, Any] = {}
        for key_node, value_node in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, str):
                raise _ForbiddenError("a word as key", repr(key), key_node.start_mark)
            if key in mapping:
                raise _ForbiddenError("each key once", f"{key!r} a second time", key_node.start_mark)
            mapping[key] = self.construct_object(value_node, deep=deep)
        return mapping


class _Writer(yaml.SafeDumper):
    """PyYAML's safe dumper; it quotes whatever a reader of YAML 1.1 or 1.2 could take for something else than text."""

    def ignore_aliases(self, data: Any) -> bool:
        """Write equal values twice rather than refer to the first."""
        del data
        return True


def _text(writer: _Writer, text: str) -> yaml.ScalarNode:
    """Write text; line breaks that only Unicode knows are escaped, since YAML would fold them into spaces."""
    style = '"' if any(sign in text for sign in "\x85\u2028\u2029") else None
    return writer.represent_scalar(CORE + "str", text, style=style)


def _float(loader: _Reader, node: yaml.ScalarNode) -> float | str:
    """Read a number; one too large for a float stays text, so that the type check shows it as it was written."""
    number = float(loader.construct_scalar(node))
    return number if math.isfinite(number) else str(node.value)


_Reader.add_constructor(CORE + "map", partial(_Reader.construct_mapping, deep=True))
_Reader.add_constructor(CORE + "float", _float)
for _kind, _pattern in (("int", INTEGER), ("float", FLOAT), ("bool", BOOLEAN), ("null", NULL)):
    _Reader.add_implicit_resolver(CORE + _kind, _pattern, None)
_Writer.add_representer(str, _text)
_Writer.add_implicit_resolver(CORE + "float", FLOAT, None)


def read_yaml(text: bytes | str, *, source: str) -> Any:
    """Read one YAML document: None, bool, int, float, str, and lists and dicts (with text keys) of these.

    Raises ScenarioError, which names source, line and column, for what is not the YAML that a scenario may use.
    """
    if len(text) > CHARACTERS_MAX:
        raise ScenarioError(expected(source, "", f"at most {CHARACTERS_MAX} characters of YAML", len(text)))
    try:
        if isinstance(text, bytes):
            text = text.decode("utf-8")
        return yaml.load(text, Loader=_Reader)  # noqa: S506 -- _Reader is a SafeLoader
    except UnicodeDecodeError as error:
        got = f"byte {error.object[error.start]:#04x} at {error.start}"
        raise ScenarioError(expected(source, "", "UTF-8 text", got)) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{source}: line {mark.line + 1}, column {mark.column + 1}" if mark else source
        if isinstance(error, _ForbiddenError):
            raise ScenarioError(expected(where, "", error.wanted, str(error.problem))) from None
        raise ScenarioError(expected(where, "", "YAML", _broken(error.problem or error.context))) from None
    except yaml.YAMLError as error:
        raise ScenarioError(expected(source, "", "YAML", _broken(str(error)))) from None
    except RecursionError:
        raise ScenarioError(expected(source, "", "YAML", "nesting that is too deep")) from None
    except (ValueError, OverflowError):  # PyYAML does not check the numbers in \U escapes and in a %YAML line
        raise ScenarioError(expected(source, "", "YAML", "broken text (a number beyond all bounds)")) from None


def write_yaml(document: dict[str, Any]) -> str:
    """Write a document that `read_yaml` reads back as it was; keys keep their order."""
    return yaml.dump(document, Dumper=_Writer, sort_keys=False, allow_unicode=True, width=100, default_flow_style=None)


def _broken(problem: str | None) -> str:
    """Bring a message of PyYAML onto one line."""
    return f"broken text ({' '.join((problem or 'unknown').split())})"
