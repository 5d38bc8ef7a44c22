"""`new_scenarios`: fires in a city that are neither lost nor held whatever brigades do."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from threading import Event
from typing import Any, Final

import msgspec

from fireworld.arguments import ArgumentError, path_of, seed_of, settings_of, whole_number
from fireworld.errors import expected
from fireworld.evaluation.check_scenarios import counts_of
from fireworld.evaluation.contested import FIRST_SEED, HELD_ABOVE, LOST_BELOW, N_SEEDS, Limits
from fireworld.evaluation.fire_base import AnyCity, FireBase, base_of
from fireworld.evaluation.found_fires import NewScenarios, check_files, files_of
from fireworld.evaluation.growth import FirePlace, Grown, grow, spreads, usual_counts
from fireworld.evaluation.inputs import in_a_row, seeds_of
from fireworld.evaluation.judge import Judge
from fireworld.evaluation.scenario_check import ScenarioCheck
from fireworld.executors import AnyExecutor, workers_for
from fireworld.interrupt import Interrupted, gentle_interrupt
from fireworld.scenario import Scenario

MOST: Final = {"n": 1000, "n_fires": 100, "brigades": 1000, "civilians": 100_000, "places": 100_000}
LEAST: Final = {"civilians": 0}
"""Bounds of the numbers; 1 is the least unless another is named."""
UNASKED: Final = {"n": 1, "n-fires": 1}
"""Options that are not said: as they are if nobody names them."""
PLACES_FOR_A_FIRE, N_PLACES_LEAST = 4, 32
"""How many places are tried unless asked otherwise: so many for each fire that is asked for, and so many at least."""


def new_scenarios(
    city: AnyCity = None,
    *,
    n: int = 1,
    seed: int = 1,
    n_fires: int = 1,
    brigades: int | None = None,
    civilians: int | None = None,
    counts: Sequence[int] | int | None = None,
    places: int | None = None,
    seeds: int | Sequence[int] = N_SEEDS,
    lost_below: float = LOST_BELOW,
    held_above: float = HELD_ABOVE,
    set: Mapping[str, Any] | None = None,
    output: str | os.PathLike[str] | None = None,
    force: bool = False,
    executor: AnyExecutor = None,
    on_place: Callable[[int, int, int], object] = lambda *_: None,
    stop: Event | None = None,
) -> NewScenarios:
    """Find contested fires in a city: fires that rules which do not learn neither all hold nor all lose.

    Places are drawn, each a building that can burn. At each the fire grows until the rules do not hold it any more; if
    it is not lost then, it is contested. The same city and arguments find the same fires, whoever makes the runs.

    Args:
        city: a city file; the folder of an official map, of which brigades, people and configuration are taken, too; a
            scenario (a name, a file or an object), of which everything stays but the fires; None: a generated city.
        n: fires to find.
        seed: of the places, of people that are drawn around them, and of a generated city.
        n_fires: fires that burn at the same time in each scenario.
        brigades: how many; None: the scenario's or the map's, else four.
        civilians: how many people are drawn around each place; None: those of the scenario or the map, else 8 to 11.
        counts: numbers of burning buildings that a fire may have, all fires of a scenario together; None: 1, 2, 3, 4,
            6, 8, 12, 16 ... up to one in eight of the buildings that can burn. Where a fire turns from held to lost,
            numbers between them are tried, too.
        places: how many are tried at most; None: four for each fire to find, 32 at least.
        seeds: of the runs of every rule: how many, from 1000 on, or which.
        lost_below: as for `check_scenarios`.
        held_above: the same.
        set: values of scenario keys, as in {"preset": "official-2013", "city.generated.columns": 40}.
        output: scenario file (.yaml) to write; of several fires the curriculum, and fires-1.yaml, fires-2.yaml ...
            beside it. Nothing is written if there are not as many as were asked for.
        force: replace existing files.
        executor: who makes the runs; see `fireworld.compare`.
        on_place: called with the number of places that were tried, of all, and of the fires found.
        stop: set it, and no further run begins.

    Raises:
        ArgumentError: an argument that makes no sense.
        CityError, ScenarioError: it is no city; or no place has room for the people, or a refuge is missing.
        OutputError: files that cannot be written.
        ExecutorError: an executor that is none.
        Interrupted: Ctrl-C, or `stop` was set; nothing is written.
    """
    _check_numbers(n=n, n_fires=n_fires, brigades=brigades, civilians=civilians, places=places)
    limits, run_seeds, seed = Limits(lost_below, held_above), seeds_of(seeds, FIRST_SEED), seed_of(seed)
    sizes = None if counts is None else _sizes(counts, n_fires)
    n_places = max(PLACES_FOR_A_FIRE * n, N_PLACES_LEAST) if places is None else places
    workers_for(executor)
    path = None if output is None else path_of("output", output)
    if path is not None:
        check_files(path, n, force=force)
    values = settings_of(set)
    base = base_of(city, seed=seed, brigades=brigades, civilians=civilians, values=values)
    sizes = sizes or usual_counts(n_fires, len(base.inflammable))
    drawn = [*base.places(seed, n_places=n_places, n_fires=n_fires)]
    names = [] if path is None else [file.stem for file in files_of(path, n)]
    try:
        with gentle_interrupt(stop) as interrupted:
            judge = Judge(run_seeds, limits, workers_for(executor, stop=interrupted), base.cities)
            checks, tried = _search(base, drawn, sizes, judge, n=n, names=names, on_place=on_place)
    except Interrupted as error:
        raise Interrupted(f"{error}; nothing is written") from None
    given = {"seed": seed, "n": n, "n-fires": n_fires, "brigades": brigades, "civilians": civilians, "places": places}
    limited = {"lost-below": lost_below, "held-above": held_above}
    options = _options(city, given, counts, seeds, limited, values)
    found = NewScenarios(checks=checks, tried=tried, n_wanted=n, options=options, city=base.plan.name)
    if path is None or not found.complete:
        return found
    return replace(found, files=tuple(found.save(path, force=force)))


def _check_numbers(**numbers: object) -> None:
    """Raise ArgumentError for a number out of its bounds; None is always good."""
    for name, value in numbers.items():
        if value is not None:
            whole_number(name, value, least=LEAST.get(name, 1), most=MOST[name])


def _sizes(counts: Sequence[int] | int, n_fires: int) -> list[int]:
    """Return the numbers of burning buildings that leave one for each fire."""
    found = [count for count in counts_of(counts) if count >= n_fires]
    if not found:
        raise ArgumentError(expected("counts", "", f"a number of at least {n_fires}, one for each fire", counts))
    return found


def _search(
    base: FireBase,
    drawn: Sequence[FirePlace],
    sizes: Sequence[int],
    judge: Judge,
    *,
    n: int,
    names: Sequence[str],
    on_place: Callable[[int, int, int], object],
) -> tuple[tuple[ScenarioCheck, ...], tuple[Grown, ...]]:
    """Return the first contested fires, n at most, and what was tried on the way.

    Raises:
        ScenarioError: what was missing, if nothing could be lit anywhere.
    """
    tried, checks = list[Grown](), list[ScenarioCheck]()
    on_place(0, len(drawn), 0)
    for place in drawn:
        if not spreads(base.scenario, place, sizes[-1], judge):
            grown = Grown(place=place, n_burning=sizes[-1], verdict="held", brigades_matter=False)
        else:
            grown = grow(base.scenario, place, sizes, judge)
        if grown.verdict == "contested" and grown.built is not None:
            name = names[len(checks)] if names else f"{base.plan.name}-fire-{len(checks) + 1}"
            words = {"name": name, "description": f"A contested fire in {base.plan.name}."}
            named = replace(grown.built, scenario=msgspec.structs.replace(grown.built.scenario, **words))
            check = judge.check(name, named, grown.rules)
            grown = replace(grown, brigades_matter=check.brigades_matter)
            checks += [check] if check.brigades_matter else []
        tried.append(grown)
        on_place(len(tried), len(drawn), len(checks))
        if len(checks) == n:
            break
    errors = [grown.error for grown in tried if grown.error is not None]
    if len(errors) == len(tried):
        raise errors[0]
    return tuple(checks), tuple(tried)


def _options(
    city: AnyCity,
    given: Mapping[str, int | None],
    counts: Sequence[int] | int | None,
    seeds: int | Sequence[int],
    limits: Mapping[str, float],
    values: Mapping[str, Any],
) -> str:
    """Return the options of the command line that find the same fires, as far as there are options for it."""
    words = [] if city is None else ["--city", city.name if isinstance(city, Scenario) else str(city)]
    for name, value in given.items():
        if value is not None and value != UNASKED.get(name):
            words += [f"--{name}", str(value)]
    if counts is not None:
        found = counts_of(counts)
        words += ["--counts", f"{found[0]}-{found[-1]}" if in_a_row(found) else ",".join(map(str, found))]
    n_seeds = seeds if isinstance(seeds, int) else len(seeds)
    if n_seeds != N_SEEDS:
        words += ["--seeds", str(n_seeds)]
    for (name, limit), usual in zip(limits.items(), (LOST_BELOW, HELD_ABOVE), strict=True):
        words += [] if limit == usual else [f"--{name}", f"{limit:g}"]
    for key, value in values.items():
        words += ["--set", f"{key}={json.dumps(value)}"]
    return shlex.join(words)
