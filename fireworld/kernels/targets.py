"""What a brigade sees of the four targets that the actions name: for learners, the features that rankings weigh."""

from __future__ import annotations

from fireworld.kernels.arrays import (
    Array,
    BrigadeConstants,
    BrigadeState,
    BuildingArrays,
    FireConstants,
    FireState,
    GeometryArrays,
    LinkArrays,
    SiteState,
)
from fireworld.kernels.jit import kernel
from fireworld.kernels.observation import N_ACTIONS, find_target, site_place
from fireworld.kernels.ranking import see_target


@kernel
def describe_targets(
    brigade: int,
    step: int,
    known: Array,
    described: Array,
    described_at: Array,
    brigades: BrigadeState,
    buildings: BuildingArrays,
    links: LinkArrays,
    geometry: GeometryArrays,
    fire: FireState,
    sites: SiteState,
    fire_constants: FireConstants,
    brigade_constants: BrigadeConstants,
    out: Array,
) -> bool:
    """Write the features of a brigade's four targets, (4, 13) float64 in the order of the actions; MODEL 7.

    They have the bits that `rank` weighs, whose arguments have the same names. Returns whether the brigade has a site;
    without one, nothing is written.
    """
    if site_place(brigade, brigades.site, sites) < 0:
        return False
    for action in range(N_ACTIONS):
        see_target(
            brigade,
            find_target(brigade, action, brigades, buildings, fire, geometry, sites),
            step,
            known,
            described,
            described_at,
            brigades,
            buildings,
            links,
            geometry,
            fire,
            sites,
            fire_constants,
            brigade_constants,
            out[action],
        )
    return True
