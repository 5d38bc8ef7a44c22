"""Everything that a log or a viewer ever sees of a run: frozen records of arrays.

This module is the one place where the recorded topics, their fields, wire types, units and shapes are
named. The recorder derives its schemas, and the log-format page of the docs, from the field metadata here.
A field number is for ever: a field may be added with a new number, never renumbered or given another type.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields
from functools import cache
from typing import Any, ClassVar, Final, Literal, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from fireworld.errors import FieldError, LogError, expected, nearest

Array = NDArray[Any]
Record = TypeVar("Record")
Wire = Literal["double", "float", "sfixed32", "fixed64", "uint8", "bool", "string", "bytes"]
Entity = Literal[
    "building", "brigade", "civilian", "site", "event", "link", "corner", "node", "street", "refuge", "hydrant",
    "offset", "axis", "scenario", "step", "choice", "table", "entry", "update", "candidate", "fire", "weight",
    "seed",
]  # fmt: skip
"""What an array can have an entry for. An offset is where the entries of a building begin in another array; the last
one is where they end."""

FORMAT: Final = "fireworld-log/1"
STEP_SECONDS: Final = 60
AIR: Final = "fire.air"
"""Name of the air in a snapshot: degrees above ambient in a grid, x by y, with a border of equal width all around."""
SNAPSHOT_EVERY_STEPS: Final = 50

ACTIONS: Final = ("easiest", "nearest-to-civilian", "nearest-to-center", "nearest-to-me")
"""The paper's four actions."""
ACTION_NAMES: Final = (*ACTIONS, "own-target")
"""All actions: the paper's four, and a target that the policy names itself. Recorded as the index here, -1 is none."""

CHOICES: Final = ("none", "greedy", "explored", "kept")
"""How a brigade that learns came to its action: it had no choice, took the best by its table, or one at random, or
repeated what it had chosen before."""

ACTIVITIES: Final = ("idle", "driving", "spraying", "driving-to-refuge", "refilling", "dead")
"""What a brigade did in a step."""

EVENT_KINDS: Final = (
    "ignited", "extinguished", "burnt-out", "civilian-hurt", "civilian-died", "tank-empty", "refilled", "site-out",
    "brigade-hurt", "brigade-died",
)  # fmt: skip
"""Kinds of events."""
EVENT_ENTITIES: Final[Mapping[str, str]] = {
    **dict.fromkeys(("ignited", "extinguished", "burnt-out"), "building"),
    **dict.fromkeys(("civilian-hurt", "civilian-died"), "civilian"),
    **dict.fromkeys(("tank-empty", "refilled", "brigade-hurt", "brigade-died"), "brigade"),
    "site-out": "site",
}
"""What the entity of an event of a kind is."""

FIERYNESS: Final = (
    "unburnt", "heating", "burning", "inferno",
    "water-damaged", "minor-damage", "moderate-damage", "severe-damage", "burnt-out",
)  # fmt: skip
"""The official fieryness codes 0 to 8; 1 to 3 burn, 5 to 7 are extinguished."""

MATERIALS: Final = ("wood", "steel", "concrete")
LEVELS: Final = ("low", "medium", "high")
VOLUMES: Final = ("very-low", "low", "medium", "high", "very-high", "huge")
SIDES: Final = ("N", "E", "S", "W")


def name_of(names: Sequence[str], code: int, what: str = "code") -> str:
    """Return the name of a recorded code; where only a later version knows it, its number: "code 7"."""
    return names[code] if 0 <= code < len(names) else f"{what} {code}"


DTYPES: Final[Mapping[str, str]] = {
    "double": "<f8",
    "float": "<f4",
    "sfixed32": "<i4",
    "fixed64": "<u8",
    "uint8": "|u1",
}
"""numpy type of an array field, by wire type ("uint8" travels as packed uint32 varints below 128)."""
_EMPTY: Final[Mapping[str, Array]] = {wire: np.zeros(0, dtype) for wire, dtype in DTYPES.items()}


def column(
    number: int,
    wire: Wire,
    doc: str,
    *,
    per: Entity,
    width: int = 1,
    names: tuple[str, ...] = (),
    unit: str = "",
    added: bool = False,
    imported: bool = False,
) -> Any:
    """Declare a packed repeated field: a one-dimensional array, with `width` entries for each of what it is `per`.

    `doc` says what its numbers mean, `names` what 0, 1, 2, ... stand for; the unit is there if the field's name does
    not end in it. A field that was `added` later is empty in recordings made before, and so by default; one of
    `imported` logs is empty in all others, which do not declare it.
    """
    metadata = {"number": number, "wire": wire, "doc": doc, "unit": unit, "per": per, "width": width, "names": names}
    metadata |= {"imported": True} if imported else {}
    optional = added or imported
    return field(metadata=metadata, default_factory=lambda: _EMPTY[wire]) if optional else field(metadata=metadata)


def value(number: int, wire: Wire, doc: str, *, unit: str = "", added: bool = False) -> Any:
    """Declare a single value, with its unit where its name does not end in it; a text that was `added` is "" before."""
    metadata = {"number": number, "wire": wire, "doc": doc, "unit": unit}
    return field(metadata=metadata, default="") if added else field(metadata=metadata)


def filled(record_type: type[Record], fields: dict[str, Any]) -> Record:
    """Return a record of its fields, by name, all of them: what its constructor does, at a fifth of the time.

    For records that are made in every step. The constructor of a frozen dataclass sets one field after another.
    """
    record = object.__new__(record_type)
    object.__setattr__(record, "__dict__", fields)
    return record


_IF_ANY: Final = {"if_any": True}
"""Of a text that is written only where it is not empty, so that the headers of other logs are what they were."""


@dataclass(frozen=True)
class RunHeader:
    """What identifies a run; recorded as the metadata `fireworld.run` and as attachments."""

    scenario: str
    scenario_digest: str
    seed: int
    policy: str
    policy_digest: str
    fireworld_version: str
    n_steps_max: int
    forked_from: str = ""
    """Digest and step of the recording this run branched off, "" for a run of its own."""
    simulator_digest: str = ""
    """Of the sources of all that computed the run, "" where nobody wrote it down."""
    origin: str = field(default="", metadata=_IF_ANY)
    """What an imported log was made from, "" for a run of fireworld."""
    not_recorded: str = field(default="", metadata=_IF_ANY)
    """Topics, and fields as in "buildings.energy", that an imported log does not have; separated by commas."""
    attachments: Mapping[str, bytes] = field(default_factory=dict)
    """Files that a replay needs, by name: scenario.yaml always, city.json, policy.npz where used."""

    @property
    def imported(self) -> bool:
        """Whether this is the log of another program, which has no decisions to replay."""
        return self.origin != ""

    @property
    def title(self) -> str:
        """Scenario, policy and, if it is known, seed."""
        seed = "" if self.lacks("seed") else f", seed {self.seed}"
        return f"{self.scenario}, {self.policy}{seed}"

    def lacks(self, name: str) -> bool:
        """Return whether a field, as in "buildings.energy", a topic, or the "seed" was not recorded."""
        absent = absent_names(self.not_recorded)
        return name in absent or name.partition(".")[0] in absent


@cache
def absent_names(not_recorded: str) -> frozenset[str]:
    """Return the names in the text of `RunHeader.not_recorded`."""
    return frozenset(name for name in not_recorded.replace(" ", "").split(",") if name)


@dataclass(frozen=True)
class CityRecord:
    """The city, recorded once. Lengths in metres; n buildings, in the order every per-building array keeps."""

    topic: ClassVar[str] = "/city"
    name: str = value(1, "string", "name of the city")
    building_id: Array = column(2, "sfixed32", "identifier of each building in its source", per="building")
    outline_ptr: Array = column(3, "sfixed32", "start of each building's corners in outline_x_m", per="offset")
    outline_x_m: Array = column(4, "double", "corners, x; the closing corner is not repeated", per="corner")
    outline_y_m: Array = column(5, "double", "corners, y", per="corner")
    center_x_m: Array = column(6, "double", "centroid, x", per="building")
    center_y_m: Array = column(7, "double", "centroid, y", per="building")
    floors: Array = column(8, "sfixed32", "storeys of 3 m", per="building")
    material: Array = column(9, "uint8", "0 wood, 1 steel, 2 concrete", per="building", names=MATERIALS)
    inflammable: Array = column(10, "uint8", "1 if it can burn", per="building")
    ground_area_m2: Array = column(11, "float", "", per="building")
    volume_m3: Array = column(12, "float", "", per="building")
    initial_fuel: Array = column(13, "float", "energy units", per="building", unit="energy units")
    heat_capacity: Array = column(
        14, "float", "energy units per degree", per="building", unit="energy units per degree"
    )
    ignition_point: Array = column(15, "float", "degrees above ambient", per="building", unit="degrees above ambient")
    wall_area_m2: Array = column(16, "double", "radiating wall", per="building")
    link_ptr: Array = column(17, "sfixed32", "start of each building's radiation links", per="offset")
    link_building: Array = column(18, "sfixed32", "index of the building a link leads to", per="link")
    link_share: Array = column(19, "float", "share of the emitted radiation that reaches it", per="link", unit="share")
    node_x_m: Array = column(20, "double", "street nodes, x", per="node")
    node_y_m: Array = column(21, "double", "street nodes, y", per="node")
    street_from: Array = column(22, "sfixed32", "first node of each street", per="street")
    street_to: Array = column(23, "sfixed32", "second node of each street", per="street")
    refuge_building: Array = column(24, "sfixed32", "index of each refuge's building", per="refuge")
    hydrant_x_m: Array = column(25, "double", "hydrants, x", per="hydrant")
    hydrant_y_m: Array = column(26, "double", "hydrants, y", per="hydrant")
    civilian_x_m: Array = column(27, "double", "position, x", per="civilian")
    civilian_y_m: Array = column(28, "double", "position, y", per="civilian")
    civilian_building: Array = column(29, "sfixed32", "building a civilian is in, -1 outdoors", per="civilian")
    civilian_hp: Array = column(30, "sfixed32", "health points at the start", per="civilian", unit="health points")
    brigade_tank_litres: Array = column(31, "sfixed32", "size of the tank", per="brigade")
    brigade_power_litres: Array = column(32, "sfixed32", "most litres sprayed in a step", per="brigade")
    brigade_range_m: Array = column(33, "double", "reach of the water jet", per="brigade")
    air_origin_x_m: float = value(34, "double", "west edge of the air grid")
    air_origin_y_m: float = value(35, "double", "south edge of the air grid")
    air_cell_m: float = value(36, "double", "side of an air cell")
    air_nx: int = value(37, "sfixed32", "air cells along x")
    air_ny: int = value(38, "sfixed32", "air cells along y")
    middle_x_m: float = value(39, "double", "centre of the city, x")
    middle_y_m: float = value(40, "double", "centre of the city, y")
    attribution: str = value(41, "string", "whom its map is by, to be named wherever it is shown; or empty", added=True)


@dataclass(frozen=True)
class Draws:
    """The random draws of a step, summed up: where these differ, runs differ for that reason."""

    topic: ClassVar[str] = "/draws"
    key: int = value(1, "fixed64", "hash of seed and step: equal keys, the same random draws")
    burn_rate_sum: float = value(2, "double", "sum of the burn rates drawn for the burning buildings")
    health_sum: float = value(3, "double", "sum of the damage draws of the people exposed or hurt")


@dataclass(frozen=True)
class Observations:
    """What each brigade saw before it chose; then the fire sites of the moment."""

    topic: ClassVar[str] = "/observations"
    site: Array = column(1, "sfixed32", "fire site the brigade belongs to, -1 none", per="brigade")
    free_edges: Array = column(2, "uint8", "sides of the site over which fire can spread, 0..4", per="brigade")
    distance_from_center: Array = column(3, "uint8", "0 low, 1 medium, 2 high", per="brigade", names=LEVELS)
    distance_from_civilian: Array = column(4, "uint8", "0 low, 1 medium, 2 high", per="brigade", names=LEVELS)
    volume: Array = column(5, "uint8", "burning volume, 0 very low .. 5 huge", per="brigade", names=VOLUMES)
    others_easiest: Array = column(6, "uint8", "1 if another brigade does `easiest`", per="brigade")
    others_nearest_to_civilian: Array = column(7, "uint8", "the same for `nearest-to-civilian`", per="brigade")
    others_nearest_to_center: Array = column(8, "uint8", "the same for `nearest-to-center`", per="brigade")
    others_nearest_to_me: Array = column(9, "uint8", "the same for `nearest-to-me`", per="brigade")
    state_index: Array = column(10, "sfixed32", "0..4319, mixed radix of the eight features; -1 none", per="brigade")
    site_id: Array = column(11, "sfixed32", "fire sites that burn, by rising number", per="site")
    site_free_sides: Array = column(12, "uint8", "bits 0 N, 1 E, 2 S, 3 W: free sides", per="site")
    site_n_burning: Array = column(13, "sfixed32", "burning buildings", per="site")
    site_volume_m3: Array = column(14, "double", "volume of the burning buildings", per="site")
    site_west_m: Array = column(15, "double", "bounding box of the burning buildings", per="site")
    site_south_m: Array = column(16, "double", "", per="site")
    site_east_m: Array = column(17, "double", "", per="site")
    site_north_m: Array = column(18, "double", "", per="site")


@dataclass(frozen=True)
class Decisions:
    """What each brigade chose, and why."""

    topic: ClassVar[str] = "/decisions"
    action: Array = column(
        1,
        "sfixed32",
        "index of the action, -1 none (refilling, dead, nothing burns)",
        per="brigade",
        names=ACTION_NAMES,
    )
    target: Array = column(2, "sfixed32", "index of the building it goes for, -1 none", per="brigade")
    explored: Array = column(3, "uint8", "1 if the action was an exploring draw", per="brigade")
    q_values: Array = column(
        4, "double", "values of the four actions, brigade by brigade; or empty", per="brigade", width=len(ACTIONS)
    )
    epsilon: float = value(5, "double", "probability of exploring", unit="probability")
    td_error: Array = column(6, "double", "SARSA's error of the last update; or empty", per="brigade")
    target_value: Array = column(
        7, "double", "value of the target, where targets are ranked; or empty", per="brigade", added=True
    )


@dataclass(frozen=True)
class Brigades:
    """Where the brigades are after the step and what they did in it."""

    topic: ClassVar[str] = "/brigades"
    x_m: Array = column(1, "double", "position, x", per="brigade")
    y_m: Array = column(2, "double", "position, y", per="brigade")
    activity: Array = column(
        3, "uint8", "0 idle, 1 driving, 2 spraying, 3 to refuge, 4 refilling, 5 dead", per="brigade", names=ACTIVITIES
    )
    tank_litres: Array = column(4, "sfixed32", "water in the tank", per="brigade")
    sprayed_litres: Array = column(5, "sfixed32", "water sprayed in this step", per="brigade")
    driven_m: Array = column(6, "double", "way driven in this step", per="brigade")
    hp: Array = column(7, "sfixed32", "health points", per="brigade", unit="health points")
    damage: Array = column(8, "double", "health points lost per step", per="brigade", unit="health points per step")


@dataclass(frozen=True)
class Buildings:
    """The fire after the step."""

    topic: ClassVar[str] = "/buildings"
    temperature: Array = column(
        1,
        "float",
        "degrees above ambient, to the nearest 1/64; exact is energy / heat_capacity",
        per="building",
        unit="degrees above ambient",
    )
    energy: Array = column(2, "double", "heat, energy units, exact", per="building", unit="energy units")
    fuel_share: Array = column(
        3, "float", "share of the initial fuel that is left, single precision", per="building", unit="share"
    )
    water_litres: Array = column(4, "sfixed32", "water lying on the building", per="building")
    fieryness: Array = column(5, "uint8", "official code 0..8", per="building", names=FIERYNESS)


@dataclass(frozen=True)
class Civilians:
    """The civilians' health after the step."""

    topic: ClassVar[str] = "/civilians"
    hp: Array = column(1, "sfixed32", "health points, 0 dead", per="civilian", unit="health points")
    damage: Array = column(2, "double", "health points lost per step", per="civilian", unit="health points per step")
    x_m: Array = column(3, "double", "position, x; imported logs only", per="civilian", imported=True)
    y_m: Array = column(4, "double", "position, y; imported logs only", per="civilian", imported=True)
    in_building: Array = column(
        5, "sfixed32", "building a civilian is in, -1 elsewhere; imported logs only", per="civilian", imported=True
    )
    buriedness: Array = column(
        6, "sfixed32", "how deep a civilian is buried, 0 free; imported logs only", per="civilian", imported=True
    )


@dataclass(frozen=True)
class Rewards:
    """The team's reward of the step, term by term; `total` is their sum."""

    topic: ClassVar[str] = "/rewards"
    water_damaged: float = value(1, "double", "weight (of the paper: -1) x water-damaged and extinguished buildings")
    burning: float = value(2, "double", "weight (of the paper: -2) x burning buildings")
    burnt_out: float = value(3, "double", "weight (of the paper: -3) x burnt-out buildings")
    civilians: float = value(4, "double", "weight (of the paper: 1) x HP - full HP of all civilians")
    total: float = value(5, "double", "reward of the step")
    sum_so_far: float = value(6, "double", "undiscounted return up to this step")


@dataclass(frozen=True)
class Score:
    """The outcome after the step."""

    topic: ClassVar[str] = "/score"
    score: float = value(1, "double", "official score of the paper's time")
    score_max: float = value(2, "double", "number of civilians + 1")
    score_now: float = value(3, "double", "the official score of today")
    n_burning: int = value(4, "sfixed32", "buildings with codes 1-3")
    n_water_damaged: int = value(5, "sfixed32", "buildings with codes 4-7")
    n_burnt_out: int = value(6, "sfixed32", "buildings with code 8")
    n_civilians_alive: int = value(7, "sfixed32", "civilians with HP > 0")
    water_used_litres: float = value(8, "double", "sprayed by all brigades so far")


@dataclass(frozen=True)
class Events:
    """What happened in the step, parallel arrays, in the order of the phases."""

    topic: ClassVar[str] = "/events"
    kind: Array = column(1, "uint8", "index into EVENT_KINDS", per="event", names=EVENT_KINDS)
    entity: Array = column(2, "sfixed32", "index of the building, civilian or brigade; number of the site", per="event")


@dataclass(frozen=True)
class Snapshot:
    """Everything that is needed to resume after this step, as named arrays."""

    topic: ClassVar[str] = "/snapshot"
    arrays: Mapping[str, Array]


@dataclass(frozen=True)
class StepRecord:
    """One committed step.

    Step 0 is the state before the first step: it has no draws, choices or rewards yet (empty arrays and zeros), but
    buildings, brigades, civilians and score are there.
    """

    step: int
    draws: Draws
    observations: Observations
    decisions: Decisions
    brigades: Brigades
    buildings: Buildings
    civilians: Civilians
    rewards: Rewards
    score: Score
    events: Events
    terminated: bool
    truncated: bool
    snapshot: Snapshot | None = None


STEP_TOPICS: Final[tuple[type[Any], ...]] = (
    Draws, Observations, Decisions, Brigades, Buildings, Civilians, Rewards, Score, Events,
)  # fmt: skip
"""The topics of a step in the order in which things happen (then /snapshot where due, then /commit)."""

PHASES: Final[Mapping[str, str]] = {
    "/city": "city",
    "/draws": "draw",
    "/observations": "observe",
    "/decisions": "choose",
    "/brigades": "act",
    "/buildings": "fire",
    "/civilians": "health",
    "/rewards": "reward",
    "/score": "reward",
    "/events": "events",
    "/snapshot": "state",
}
"""The phase of a step that each topic belongs to."""

_STEP_TOPICS: Final = {topic.topic.removeprefix("/"): topic for topic in STEP_TOPICS}


@cache
def find_field(topic: str, name: str = "") -> tuple[type[Any], Field[Any]]:
    """Return the record type and the field, with its metadata, of "/buildings" and a name, or "buildings.temperature".

    This is the one place that knows how a field can be called. Raises FieldError with all there are, and the nearest.
    """
    full = f"{topic}.{name}" if name else topic
    topic, _, name = full.removeprefix("/").partition(".")
    if topic not in _STEP_TOPICS:
        known = {f"{one}.{item.name}": item.name for one, record in _STEP_TOPICS.items() for item in fields(record)}
        named = [one for one, last in known.items() if last == topic]
        hint = f"try {', '.join(named)}" if named else nearest(full.removeprefix("/"), [*known, *_STEP_TOPICS])
        raise FieldError(expected("topic of a recording", "", f"one of {', '.join(_STEP_TOPICS)}", topic, hint))
    found = {item.name: item for item in fields(_STEP_TOPICS[topic])}
    if name not in found:
        raise FieldError(expected(f"field of {topic}", "", f"one of {', '.join(found)}", name, nearest(name, found)))
    return _STEP_TOPICS[topic], found[name]


class Steps(Protocol):
    """A run, step by step: all that a recording or a comparison needs. Iterating may compute it."""

    @property
    def header(self) -> RunHeader:
        """What identifies the run."""

    @property
    def city(self) -> CityRecord:
        """The city it ran in."""

    def __iter__(self) -> Iterator[StepRecord]: ...


@runtime_checkable
class Recording(Steps, Protocol):
    """A recorded run as a viewer or a table reads it: which steps there are, and single fields over all of them."""

    @property
    def steps(self) -> Array:
        """(k,) int64: the committed steps, rising."""

    def column(self, topic: str, name: str = "") -> Array:
        """Return one field, named as for `find_field`, over all steps: (k, width) of an array field, (k,) of a value.

        Raises FieldError if its length changes from step to step (sites, events); for those there is `ragged`.
        """

    def ragged(self, topic: str, name: str = "") -> Sequence[Array]:
        """Return one array field over all steps as a list of k arrays."""


@runtime_checkable
class StoredRun(Recording, Protocol):
    """A recorded run of which each step can be had by its number, and which may know its digest."""

    @property
    def digest(self) -> str:
        """The identity of the run, 64 hexadecimal digits; empty if it is not known."""

    @property
    def state(self) -> str:
        """complete, partial or damaged."""

    @property
    def damage(self) -> str | None:
        """What is wrong, and up to which step it is good; None if nothing is wrong."""

    def __len__(self) -> int: ...

    def step(self, number: int) -> StepRecord:
        """Return one step; LogError if there is no such step."""


class RecordingBase(ABC):
    """What recordings have in common that hold their steps: fields over all steps, from the field of each step."""

    header: RunHeader
    city: CityRecord

    @property
    @abstractmethod
    def steps(self) -> Array:
        """(k,) int64: the committed steps, rising."""

    @abstractmethod
    def values(self, record_type: type[Any], item: Field[Any]) -> Iterator[Any]:
        """Yield a field, as `find_field` returns it, of every step."""

    def column(self, topic: str, name: str = "") -> Array:
        """Return one field over all steps, as `Recording` defines it; LogError if the file changed meanwhile."""
        record_type, item = find_field(topic, name)
        dtype = DTYPES[item.metadata["wire"]]
        table = np.empty((0, 0) if "per" in item.metadata else 0, dtype)
        for row, value in enumerate(self.values(record_type, item)):
            if row == 0:
                table = np.empty((len(self), *np.shape(value)), dtype)
            if np.shape(value) != table.shape[1:]:
                raise FieldError(f"{record_type.topic}: {item.name}: its length changes from step to step; use ragged")
            table[row] = value
        return table

    def ragged(self, topic: str, name: str = "") -> list[Array]:
        """Return one array field over all steps as a list of k arrays; errors as for `column`."""
        record_type, item = find_field(topic, name)
        return [np.asarray(value, DTYPES[item.metadata["wire"]]) for value in self.values(record_type, item)]

    def position(self, number: int) -> int:
        """Return the position of a step in `steps`; LogError if there is no such step."""
        steps = self.steps
        found = np.flatnonzero(steps == number)
        if not len(found):
            held = f"one of the steps {steps[0]} to {steps[-1]}" if len(steps) else "a recording with steps"
            raise LogError(expected("step", "", held, number))
        return int(found[0])

    def __len__(self) -> int:
        return len(self.steps)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.header.title}, {len(self)} steps>"


class MemoryRecording(RecordingBase):
    """A recording held in memory, a `StoredRun`: the steps of a run that was not written to a file."""

    state: Final = "complete"
    damage: Final = None

    def __init__(self, header: RunHeader, city: CityRecord, records: Sequence[StepRecord], *, digest: str = "") -> None:
        self.header = header
        self.city = city
        self.digest = digest
        """Of the whole run; empty if it is not known."""
        self._records = list(records)

    @property
    def steps(self) -> Array:
        """(k,) int64: the steps held, rising."""
        return np.array([record.step for record in self._records], dtype=np.int64)

    def __iter__(self) -> Iterator[StepRecord]:
        return iter(self._records)

    def values(self, record_type: type[Any], item: Field[Any]) -> Iterator[Any]:
        """Yield a field of every step."""
        return (getattr(getattr(record, record_type.topic[1:]), item.name) for record in self._records)

    def step(self, number: int) -> StepRecord:
        """Return one step; errors as for `position`."""
        return self._records[self.position(number)]
