"""Scenario: a validated scenario file, its physical parameters and its digest."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import msgspec
import msgspec.inspect

from fireworld.errors import ScenarioError, expected
from fireworld.files import read_input, text_of
from fireworld.parameters import Parameters
from fireworld.rewards import paper_weights
from fireworld.scenario.document import Document, broken_rules, resolve_parameters
from fireworld.scenario.explain import find_faults
from fireworld.scenario.yaml_text import read_yaml, write_yaml

SIZE_MAX_BYTES: Final = 1_000_000
DEPTH_MAX: Final = 20
DIGITS_MAX: Final = 18
CITY_BYTES_MAX: Final = 1 << 28
"""Room for the outlines and streets of a city of half a million buildings."""
OFFICIAL_READER: Final = "fireworld.city.formats.official.text"
"""The module that makes a city file of an official map; named, for cities are built on scenarios."""


_DEFAULTS: Final = dict(zip(Document.__struct_fields__, Document.__struct_defaults__, strict=True))
"""Defaults of a scenario's keys."""


class Scenario(Document, frozen=True, kw_only=True):
    """A scenario ready to be placed in its city: from YAML, from plain values, or from keyword arguments.

    Scenario(city={"generated": {"columns": 6, "rows": 4}}, fires=[{"at": [0.5, 0.5]}], steps=50) checks its values as
    a scenario file's are. `city.file` is an absolute path; or as written, where the city does not come from a file.
    """

    source: str = ""
    """The file (or flag) that errors name."""
    city_sha256: str | None = None
    """Digest of the city file, None for a generated city."""

    def __post_init__(self) -> None:
        """Check values that were given as keyword arguments, and not read from a file."""
        if self.source:
            return
        values = {key: getattr(self, key) for key in Document.__struct_fields__}
        given = {key: value for key, value in values.items() if value is not _DEFAULTS.get(key)}
        checked = scenario_of(to_plain(given, source="Scenario"), source="Scenario", folder=Path())
        for key in Scenario.__struct_fields__:
            msgspec.structs.force_setattr(self, key, getattr(checked, key))

    @classmethod
    def from_yaml(cls, text: str | bytes, *, folder: Path | str = ".") -> Scenario:
        """Read a scenario from the text of a scenario file.

        Args:
            text: YAML.
            folder: where city files are relative to.

        Raises:
            ScenarioError: broken YAML, or a scenario that makes no sense.
        """
        return parse_scenario(text, source="Scenario", folder=Path(folder))

    @classmethod
    def from_dict(cls, values: Mapping[str, Any], *, folder: Path | str = ".") -> Scenario:
        """Make a scenario of the keys and values that its file would have.

        Raises:
            ScenarioError: a key or value that a scenario file could not have either.
        """
        return scenario_of(to_plain(values, source="Scenario"), source="Scenario", folder=Path(folder))

    @property
    def resolved_parameters(self) -> Parameters:
        """The physical parameters: the preset's with the scenario's overrides."""
        return resolve_parameters(self)

    @property
    def resolved(self) -> dict[str, Any]:
        """The scenario as plain values with nothing left to presets, defaults or the place of files."""
        content = self._document()
        content["parameters"] = asdict(self.resolved_parameters)
        if self.city.generated is None:  # an official map is recorded as the city file that it makes
            content["city"] |= {"file": self.city.named_file.name, "sha256": self.city_sha256}
            content["city"] |= {"official": None, "scenario": None}
        for key, usual in (("allocation", "fixed"), ("targets", "anew")):
            if content["brigades"][key] == usual:  # left out: scenarios from before the key keep their digests
                content["brigades"][key] = None
        resolved: dict[str, Any] = _without_nulls(content)
        return resolved

    @property
    def digest(self) -> str:
        """SHA-256 of everything that can change a run: all but names, the description and the preset's name."""
        content = self.resolved
        for key in ("name", "description", "preset"):
            del content[key]
        content["city"].pop("file", None)
        return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()

    def to_yaml(self) -> str:
        """Write the resolved scenario; read again, it has the same digest."""
        return write_yaml(self.resolved)

    def with_settings(self, settings: Mapping[str, str]) -> Scenario:
        """Return the scenario with other values, given as text.

        Args:
            settings: YAML values by dotted key, as in {"brigades.n": "7", "fires.0.n_buildings": "12"}.

        Raises:
            ScenarioError: a key or value that a scenario file could not have either.
        """
        values = {key: read_yaml(text, source=f"--set {key}") for key, text in settings.items()}
        return self._with(values, words=[f"--set {key}={text}" for key, text in settings.items()])

    def with_values(self, values: Mapping[str, Any]) -> Scenario:
        """Return the scenario with other values.

        Args:
            values: by dotted key, as in {"brigades.n": 7, "fires.0.n_buildings": 12}.

        Raises:
            ScenarioError: a key or value that a scenario file could not have either.
        """
        plain = to_plain(values, source="set")
        return self._with(plain, words=[f"--set {key}={json.dumps(value)}" for key, value in plain.items()])

    def _with(self, values: Mapping[str, Any], *, words: list[str]) -> Scenario:
        document = self._document()
        for key, value in values.items():
            kind = document.get("reward")
            if key.startswith("reward.") and isinstance(kind, str):  # one weight is set, the others stay
                document["reward"] = {**paper_weights(), "of": kind}
            _assign(document, key, value, source=f"--set {key}")
        source = f"{self.source} with " + " ".join(words)
        return scenario_of(document, source=source if values else self.source, folder=Path())

    def __repr__(self) -> str:
        people = f"{self.brigades.n} brigades, {self.civilians.count} civilians"
        return f"<Scenario {self.name or 'without a name'}: {self.city.summary}, {people}, {self.steps} steps>"

    def _document(self) -> dict[str, Any]:
        """Return the content of the scenario's file, as plain values."""
        content: dict[str, Any] = json.loads(json.dumps(msgspec.to_builtins(self)))  # a path may have odd bytes
        del content["source"], content["city_sha256"]
        return content


def parse_scenario(text: bytes | str, *, source: str, folder: Path | None = None) -> Scenario:
    """Read a scenario from YAML; ScenarioError, which names the source, if it makes no sense.

    City files are relative to the folder; None leaves their names as written, where the city comes with a recording.
    """
    document = read_yaml(text, source=source)
    if not isinstance(document, dict):
        got = "nothing at all" if document is None else f"a {type(document).__name__} value"
        raise ScenarioError(expected(source, "", "a scenario (keys and values)", got))
    return scenario_of(document, source=source, folder=folder)


def to_plain(values: Mapping[str, Any], *, source: str) -> dict[str, Any]:
    """Return values as a YAML reader would: dicts, lists, text, numbers, booleans and None; else ScenarioError."""
    try:
        plain = msgspec.to_builtins(values, enc_hook=_plain_number)
    except (TypeError, NotImplementedError, ValueError) as error:
        raise ScenarioError(expected(source, "", "keys with plain values", str(error))) from None
    if not isinstance(plain, dict) or not all(isinstance(key, str) for key in plain):
        raise ScenarioError(expected(source, "", "keys with plain values", type(values).__name__))
    as_read: dict[str, Any] = json.loads(json.dumps(plain))  # tuples become lists
    return as_read


def _plain_number(value: object) -> Any:
    """Return a number of numpy as a Python one."""
    item = getattr(value, "tolist", None)
    if item is None:
        raise NotImplementedError(f"a value of type {type(value).__name__}")
    return item()


def scenario_of(values: Mapping[str, Any], *, source: str, folder: Path | None) -> Scenario:
    """Validate plain values as a scenario; arguments as for `parse_scenario`."""
    try:
        document = msgspec.convert(values, Document)
    except msgspec.ValidationError as error:
        for fault in find_faults(values, msgspec.inspect.type_info(Document)):
            raise ScenarioError(expected(source, fault.key, fault.wanted, fault.got, fault.hint)) from None
        raise ScenarioError(f"{source}: {error}") from None
    for key, wanted, got in broken_rules(document):
        raise ScenarioError(expected(source, key, wanted, got))
    content = {item: getattr(document, item) for item in Document.__struct_fields__}
    city = document.city
    if city.file is not None and folder is not None:
        content["city"] = msgspec.structs.replace(city, file=str((folder / city.file).absolute()))
    if city.official is not None and folder is not None:
        content["city"] = msgspec.structs.replace(city, official=str((folder / city.official).absolute()))
    scenario = Scenario(**content, source=source, city_sha256=city.sha256)
    if city.generated is not None or city.sha256 is not None:
        return scenario
    return msgspec.structs.replace(scenario, city_sha256=hashlib.sha256(read_city_file(scenario)).hexdigest())


def read_scenario(path: Path, *, source: str | None = None) -> Scenario:
    """Read a scenario file; its name is the file's unless it has another. Errors name the source, else the path."""
    source = source or str(path)
    text = read_input(
        path,
        what="a scenario",
        n_bytes_max=SIZE_MAX_BYTES,
        error=ScenarioError,
        source=source,
        or_names="a scenario file",
    )
    scenario = parse_scenario(text, source=source, folder=path.parent)
    return scenario if scenario.name else msgspec.structs.replace(scenario, name=text_of(path.stem))


def read_city_file(scenario: Scenario) -> bytes:
    """Read the city file that a scenario names, or make it of the official map that it names."""
    if scenario.city.official is not None:
        folder = Path(scenario.city.official)
        made: bytes = import_module(OFFICIAL_READER).city_file(folder, scenario=scenario.city.scenario)
        return made
    path, source = Path(scenario.city.file or ""), scenario.source
    return read_input(
        path, what="a city file", n_bytes_max=CITY_BYTES_MAX, error=ScenarioError, source=source, key="city.file"
    )


def split_settings(settings: Iterable[str], *, example: str = "brigades.n=7") -> dict[str, str]:
    """Split the command line's KEY=VALUE into what `Scenario.with_settings` takes; errors suggest the example."""
    values: dict[str, str] = {}
    for setting in settings:
        key, equals, text = setting.partition("=")
        if not (key and equals):
            raise ScenarioError(expected("--set", "", "KEY=VALUE", setting, f"try {example}"))
        if key in values:
            raise ScenarioError(expected("--set", key, "each key once", f"{key} a second time"))
        values[key] = text
    return values


def _assign(document: dict[str, Any], key: str, value: object, *, source: str) -> None:
    """Set one value in a tree of dicts and lists by its dotted key."""
    at: Any = document
    if key.count(".") >= DEPTH_MAX:
        raise ScenarioError(expected(source, key, f"a key of at most {DEPTH_MAX} parts", key.count(".") + 1))
    *parents, last = key.split(".")
    for depth, name in enumerate(parents):
        index = _entry(at, name, key=".".join(parents[: depth + 1]), source=source)
        at[index] = at[index] if at[index] is not None else {}
        at = at[index]
    at[_entry(at, last, key=key, source=source)] = value


def _entry(at: Any, name: str, *, key: str, source: str) -> str | int:
    """Return the key or index of an entry, making room for a new one; `key` is the whole path to it."""
    if isinstance(at, dict):
        at.setdefault(name, None)
        return name
    if not isinstance(at, list):
        raise ScenarioError(expected(source, key, "a key of a scenario", "a part of a plain value"))
    if not name.isdecimal() or len(name) > DIGITS_MAX or int(name) > len(at):
        raise ScenarioError(expected(source, key, f"a number from 0 to {len(at)}", name))
    if int(name) == len(at):
        at.append(None)
    return int(name)


def _without_nulls(value: Any) -> Any:
    """Drop the keys without a value."""
    if isinstance(value, dict):
        return {key: _without_nulls(content) for key, content in value.items() if content is not None}
    return [_without_nulls(item) for item in value] if isinstance(value, list) else value
