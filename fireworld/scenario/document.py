"""The keys of a scenario file: their types, bounds, defaults and meaning, and the rules between them.

The docs' field reference and the wording of errors are made from these types.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeVar

import msgspec
from msgspec import Meta, Struct

from fireworld import rewards
from fireworld.parameters import PRESETS, BrigadeParameters, FireParameters, HealthParameters, Parameters
from fireworld.scenario.observed import Fraction, Metres, Observed

Preset = Literal["official-2011", "official-2013", "paper"]
Choices = Literal["in-turn", "simultaneous"]
Allocation = Literal["fixed", "free"]
Targets = Literal["anew", "kept"]
Direction = Literal["N", "E", "S", "W"]
DIRECTIONS: Final[tuple[Direction, ...]] = ("N", "E", "S", "W")

Point = tuple[Fraction, Fraction]
"""A place as fractions of the city's bounding box: x from west to east, y from south to north."""
LOTS_MAX: Final = 500_000
"""What is built of so many buildings takes about 1 GB; what a run, a log and a viewer make of it comes on top."""
SIDE_MAX: Final = 10_000
Seed = Annotated[int, Meta(ge=0, le=2**32 - 1)]
BuildingIds = Annotated[tuple[int, ...], Meta(min_length=1)]

POSITIVE: Final = Meta(gt=0, le=1e9)
SHARE: Final = Meta(ge=0, le=1)
ANY_AMOUNT: Final = Meta(ge=0, le=10**9)
BOUNDS: Final = {
    **{
        f"{name}_{material}": POSITIVE
        for name in ("fuel_density", "heat_capacity", "ignition_point")
        for material in ("wood", "steel", "concrete")
    },
    "air_cell_mm": Meta(ge=1000, le=100_000),
    "air_heat_capacity": POSITIVE,
    "air_heat_kept": SHARE,
    "ray_rate_per_mm": Meta(gt=0, le=1),
    "ray_range_mm": Meta(ge=1, le=10_000_000),
    "slight_probability": SHARE,
    "serious_probability": SHARE,
    "critical_probability": SHARE,
    "initial_hp": Meta(ge=1, le=1_000_000),
    "brigade_share": SHARE,
    "tank_litres": Meta(ge=1, le=10**9),
}
"""Bounds of the physical parameters that are not simply zero or more."""


def _overrides(section: type[Any], name: str) -> Any:
    """Make the type of one section of overrides: every parameter, null (the default) for the preset's value."""
    kinds = {"int": int, "float": float}
    keys = [
        (item.name, Annotated[kinds[str(item.type)], BOUNDS.get(item.name, ANY_AMOUNT)] | None, None)
        for item in fields(section)
    ]
    return msgspec.defstruct(name, keys, frozen=True, kw_only=True, forbid_unknown_fields=True)


if TYPE_CHECKING:
    FireOverrides = Struct
    HealthOverrides = Struct
    BrigadeOverrides = Struct
else:
    FireOverrides = _overrides(FireParameters, "FireOverrides")
    HealthOverrides = _overrides(HealthParameters, "HealthOverrides")
    BrigadeOverrides = _overrides(BrigadeParameters, "BrigadeOverrides")


class Overrides(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Physical parameters that differ from the preset."""

    fire: FireOverrides = FireOverrides()
    health: HealthOverrides = HealthOverrides()
    brigades: BrigadeOverrides = BrigadeOverrides()


class GeneratedCity(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A synthetic city."""

    columns: Annotated[int, Meta(ge=1, le=SIDE_MAX, description="Lots from west to east.")]
    rows: Annotated[int, Meta(ge=1, le=SIDE_MAX, description="Lots from south to north.")]
    seed: Annotated[Seed, Meta(description="Another seed, another city of the same size.")] = 1
    lot_m: Annotated[float, Meta(ge=5, le=100, description="Side of a square lot.")] = 14.0
    block: Annotated[
        tuple[Annotated[int, Meta(ge=1, le=SIDE_MAX)], Annotated[int, Meta(ge=1, le=SIDE_MAX)]],
        Meta(description="Lots of a block, along x and along y."),
    ] = (3, 2)
    street_m: Annotated[float, Meta(ge=1, le=100, description="Width of a street.")] = 8.0
    refuges: Annotated[
        tuple[Point, ...], Meta(min_length=1, description="Where refuges stand: the lot nearest to each point.")
    ] = ((0.15, 0.15), (0.85, 0.85))
    fill: Annotated[
        tuple[Annotated[float, Meta(ge=0.25, le=1)], Annotated[float, Meta(ge=0.25, le=1)]],
        Meta(description="Least and greatest share of its lot that a building covers."),
    ] = (0.7, 0.97)
    hydrant_share: Annotated[Fraction, Meta(description="Share of the crossings that have a hydrant.")] = 0.0


Weight = Annotated[float, Meta(ge=-1e9, le=1e9)]
KIND: Final = Meta(description="; ".join(f"`{kind}`: {text}" for kind, text in rewards.KINDS.items()) + ".")


def _weight(term: rewards.Term) -> tuple[str, Any, float]:
    """Return the key of a term's weight, its type and its default."""
    text = f"Weight of {term.meaning}; the paper's: {term.paper_weight:g}."
    return term.name, Annotated[Weight, Meta(description=text)], 0.0


if TYPE_CHECKING:

    class RewardWeights(Struct):
        """Weights of the terms of a reward."""

        of: rewards.Kind
else:
    RewardWeights = msgspec.defstruct(
        "RewardWeights",
        [*map(_weight, rewards.TERMS), ("of", Annotated[rewards.Kind, KIND], "stock")],
        frozen=True,
        kw_only=True,
        forbid_unknown_fields=True,
    )


class CitySource(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where the city comes from: exactly one of `generated`, `file` and `official`."""

    generated: Annotated[GeneratedCity | None, Meta(description="A synthetic city.")] = None
    file: Annotated[
        str | None, Meta(description="A city file (JSON), relative to the folder of the scenario file.")
    ] = None
    official: Annotated[
        str | None,
        Meta(description="Folder of an official map (map.gml, *.cfg), relative to the folder of the scenario file."),
    ] = None
    scenario: Annotated[
        str | None,
        Meta(description="With `official`: the scenario.xml to read, relative to that folder; null is its own."),
    ] = None
    sha256: Annotated[
        Annotated[str, Meta(pattern="^[0-9a-f]{64}$")] | None,
        Meta(description="Digest that the city file (or what is read of an official map) must have; null: any."),
    ] = None
    ray_seed: Annotated[Seed, Meta(description="Seed of the random rays that measure radiation between buildings.")] = 1

    refuges: Annotated[
        BuildingIds | None, Meta(description="Ids of the buildings that are refuges; null: those of the map.")
    ] = None
    hydrants: Annotated[
        tuple[int, ...] | None, Meta(description="Ids of the roads with a hydrant; null: those of the map.")
    ] = None
    gas_stations: Annotated[
        tuple[int, ...] | None, Meta(description="Ids of the buildings that are gas stations; null: those of the map.")
    ] = None

    @property
    def named_file(self) -> Path:
        """The city file; of an official map the name that its city file would have."""
        return Path(self.file or f"{self.official}.json")

    @property
    def summary(self) -> str:
        """What city it is, in a few words."""
        generated = self.generated
        if self.official is not None:
            return PurePath(self.official).name
        return PurePath(self.file or "").name if generated is None else f"{generated.columns} x {generated.rows} lots"


class Fire(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Buildings that burn, from the start or from a later step on: exactly one of `at` and `buildings`."""

    at: Annotated[Point | None, Meta(description="Centre of the fire: x, y as fractions of the city, y to north.")] = (
        None
    )
    n_buildings: Annotated[
        Annotated[int, Meta(ge=1, le=100_000)] | None,
        Meta(description="With `at`: how many of the inflammable buildings nearest to it burn; null is 1."),
    ] = None
    buildings: Annotated[BuildingIds | None, Meta(description="Ids of the buildings that burn.")] = None
    step: Annotated[
        Annotated[int, Meta(ge=1, le=100_000)] | None,
        Meta(description="Step at whose beginning it is lit; null: it burns at the start."),
    ] = None


class Civilians(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """People: exactly one of `n`, `buildings` and `at`."""

    n: Annotated[
        Annotated[int, Meta(ge=0, le=100_000)] | None,
        Meta(description="How many to place at random in inflammable buildings that do not burn at the start."),
    ] = None
    buildings: Annotated[
        BuildingIds | None, Meta(description="Ids of the buildings they are in, one for each; repeats are several.")
    ] = None
    at: Annotated[
        BuildingIds | None,
        Meta(description="Ids of the buildings and roads they are in or on, one for each; repeats are several."),
    ] = None
    around: Annotated[
        Point | None, Meta(description="With `n`: point they are placed around; null is the centre of the first fire.")
    ] = None
    from_m: Annotated[Metres, Meta(description="With `n`: least distance from that point.")] = 0.0
    to_m: Annotated[Metres | None, Meta(description="With `n`: greatest distance from it; null is any.")] = None
    directions: Annotated[
        tuple[Direction, ...],
        Meta(min_length=1, description="With `n`: on which sides of that point, taken in turn."),
    ] = DIRECTIONS
    seed: Annotated[Seed, Meta(description="With `n`: seed of the random placement.")] = 1

    @property
    def count(self) -> int:
        """How many they are."""
        return len(self.buildings or ()) + len(self.at or ()) + (self.n or 0)


class BrigadeTeam(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The fire brigades; they start at the refuges in turn, or at the places of `at`."""

    n: Annotated[int, Meta(ge=1, le=1000, description="How many brigades.")] = 4
    at: Annotated[
        BuildingIds | None,
        Meta(description="Ids of the buildings and roads where they start, in turn; null: the refuges."),
    ] = None
    allocation: Annotated[
        Allocation,
        Meta(
            description="`fixed`: a brigade belongs to one fire site until that is out, and names targets of its own "
            "there only; `free`: it may name those of any site, and belongs to the site of the one that it goes for."
        ),
    ] = "fixed"
    targets: Annotated[
        Targets,
        Meta(
            description="`anew`: a brigade chooses in every step; `kept`: it stays with what it chose while its "
            "target burns and is of its fire site, and is not asked meanwhile."
        ),
    ] = "anew"


class Document(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All that a scenario file holds."""

    name: Annotated[str, Meta(description="Name of the scenario; by default the file's.")] = ""
    description: Annotated[str, Meta(description="What is to see here, in one line.")] = ""
    preset: Annotated[Preset, Meta(description="Physical parameters to start from.")] = "paper"
    parameters: Annotated[
        Overrides, Meta(description="Physical parameters that differ from the preset, by section.")
    ] = Overrides()
    city: Annotated[CitySource, Meta(description="The city.")]
    fires: Annotated[tuple[Fire, ...], Meta(min_length=1, description="What burns at the start.")]
    civilians: Annotated[Civilians, Meta(description="The people to save.")] = Civilians(n=0)
    brigades: Annotated[BrigadeTeam, Meta(description="The team.")] = BrigadeTeam()
    steps: Annotated[int, Meta(ge=1, le=100_000, description="Steps (minutes) after which the run ends.")] = 500
    reward: Annotated[
        rewards.Kind | RewardWeights,
        Meta(description="What a step is worth. `stock` or `change`: with the paper's weights."),
    ] = "stock"
    choices: Annotated[
        Choices,
        Meta(description="`in-turn`: brigades see what those before them chose in this step; or `simultaneous`."),
    ] = "in-turn"
    unit_volume_m3: Annotated[
        Annotated[float, POSITIVE] | None,
        Meta(description="Unit of the burning volume a brigade sees; null is twice the mean building volume."),
    ] = None
    observation: Annotated[
        Observed | None, Meta(description="What brigades see, where it is not as in the model; null: as there.")
    ] = None


DocumentT = TypeVar("DocumentT", bound=Document)
Section = TypeVar("Section", FireParameters, HealthParameters, BrigadeParameters)


def resolve_parameters(document: Document) -> Parameters:
    """Return the preset's parameters with the document's overrides."""
    preset, overrides = PRESETS[document.preset], document.parameters
    return Parameters(
        fire=_override(preset.fire, overrides.fire),
        health=_override(preset.health, overrides.health),
        brigades=_override(preset.brigades, overrides.brigades),
    )


def resolve_reward(document: Document) -> rewards.Reward:
    """Return the document's reward as kernels take it."""
    given = document.reward
    if isinstance(given, str):
        return rewards.reward_of(given)
    weights = msgspec.structs.asdict(given)
    return rewards.reward_of(weights.pop("of"), weights)


def with_kind(document: DocumentT, kind: rewards.Kind) -> DocumentT:
    """Return a document whose reward is of another kind, with the same weights."""
    given = document.reward
    reward = kind if isinstance(given, str) else msgspec.structs.replace(given, of=kind)
    return msgspec.structs.replace(document, reward=reward)


def _override(preset: Section, overrides: Struct) -> Section:
    """Return a section of parameters with those replaced that a scenario names."""
    named = {key: value for key, value in msgspec.structs.asdict(overrides).items() if value is not None}
    return replace(preset, **named)


def broken_rules(document: Document) -> Iterator[tuple[str, str, object]]:
    """Yield (key, what is expected, what was found) for every rule between keys that does not hold."""
    yield from _broken_city_rules(document.city)
    for index, fire in enumerate(document.fires):
        yield from _not_one(f"fires.{index}", at=fire.at, buildings=fire.buildings)
        if fire.at is None and fire.n_buildings is not None:
            yield f"fires.{index}.n_buildings", "null without `at`", fire.n_buildings
        yield from _repeated(f"fires.{index}.buildings", fire.buildings or ())
    civilians = document.civilians
    yield from _not_one("civilians", n=civilians.n, buildings=civilians.buildings, at=civilians.at)
    if civilians.to_m is not None and civilians.to_m < civilians.from_m:
        yield "civilians.to_m", f"at least from_m ({civilians.from_m})", civilians.to_m
    yield from _repeated("civilians.directions", civilians.directions)
    for key in ("center_shares", "civilian_m"):
        low, high = getattr(document.observation, key, None) or (0.0, 0.0)
        if low > high:
            yield f"observation.{key}", "the lower threshold before the higher", f"the list {[low, high]}"
    if not any(resolve_reward(document).weights):
        names = ", ".join(term.name for term in rewards.TERMS)
        yield "reward", f"a weight other than 0 for one of {names}", "none of them"
    health = resolve_parameters(document).health
    probabilities = (health.slight_probability, health.serious_probability, health.critical_probability)
    if math.fsum(probabilities) > 1:
        yield "parameters.health", "slight, serious and critical probabilities of at most 1 together", probabilities


def _broken_city_rules(city: CitySource) -> Iterator[tuple[str, str, object]]:
    """Yield the rules between the keys of a city that do not hold."""
    yield from _not_one("city", generated=city.generated, file=city.file, official=city.official)
    if city.generated is not None and city.sha256 is not None:
        yield "city.sha256", "null without `file` or `official`", city.sha256
    if city.official is None and city.scenario is not None:
        yield "city.scenario", "null without `official`", city.scenario
    for key in ("refuges", "hydrants", "gas_stations"):
        yield from _repeated(f"city.{key}", getattr(city, key) or ())
    if city.generated is None:
        return
    columns, rows = city.generated.columns, city.generated.rows
    refuges, fill = city.generated.refuges, city.generated.fill
    if columns * rows > LOTS_MAX:
        yield "city.generated", f"at most {LOTS_MAX} lots", f"{columns} x {rows}"
    if columns * rows < len(refuges):
        yield "city.generated.refuges", f"at most {columns * rows}, one a lot", len(refuges)
    if fill[0] > fill[1]:
        yield "city.generated.fill", "the least share before the greatest", f"the list {list(fill)}"


def _not_one(key: str, **options: object) -> Iterator[tuple[str, str, object]]:
    """Check that exactly one of some keys has a value."""
    n_given = sum(value is not None for value in options.values())
    if n_given != 1:
        *others, last = (f"`{name}`" for name in options)
        found = {0: "none", len(options): "both" if others[1:] == [] else "all"}.get(n_given, str(n_given)) + " of them"
        yield key, f"exactly one of {', '.join(others)} and {last}", found


def _repeated(key: str, values: tuple[object, ...]) -> Iterator[tuple[str, str, object]]:
    """Find what a list holds twice."""
    seen: set[object] = set()
    for value in values:
        if value in seen:
            yield key, "each entry once", f"{value} a second time"
            return
        seen.add(value)
