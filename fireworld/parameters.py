"""Named physical parameters with their units, and the presets of the official simulator.

Every value is a fact of the official RoboCup Rescue simulator of the named year, or of `paper`: the values that
fireworld uses where the paper is silent. A scenario may set any of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final


@dataclass(frozen=True, kw_only=True)
class FireParameters:
    """The fire model. Temperatures in degrees above ambient, energies in the official arbitrary unit."""

    fuel_density_wood: float = 2400.0
    fuel_density_steel: float = 800.0
    fuel_density_concrete: float = 350.0
    heat_capacity_wood: float = 1.1
    heat_capacity_steel: float = 1.0
    heat_capacity_concrete: float = 1.5
    ignition_point_wood: float = 47.0
    ignition_point_steel: float = 47.0
    ignition_point_concrete: float = 47.0
    burn_rate_mean: float = 0.15
    burn_rate_sd: float = 0.02
    air_cell_mm: int = 5000
    air_to_air_flow: float = 1.0
    air_to_building_flow: float = 0.0015
    air_heat_capacity: float = 0.004
    air_heat_kept: float = 0.86
    radiation_coefficient: float = 0.011
    ray_rate_per_mm: float = 0.0025
    ray_range_mm: int = 200_000
    water_heat_per_litre: float = 20.0
    water_unburnt_share: float = 0.2
    flush_temperature: float = 0.0
    """Heat below this temperature is set to exactly zero after each step: small fires get faster. 0: off."""


@dataclass(frozen=True, kw_only=True)
class HealthParameters:
    """Damage of people inside burning buildings, in health points."""

    initial_hp: int = 10_000
    slight_damage: float = 5.0
    slight_probability: float = 0.4
    serious_damage: float = 20.0
    serious_probability: float = 0.2
    critical_damage: float = 100.0
    critical_probability: float = 0.1
    growth: float = 0.00025
    constant: float = 0.03
    noise_mean: float = 0.1
    noise_sd: float = 0.01
    brigade_share: float = 0.2


@dataclass(frozen=True, kw_only=True)
class BrigadeParameters:
    """A fire brigade: tank, jet and engine."""

    tank_litres: int = 7500
    power_litres: int = 500
    refuge_refill_litres: int = 500
    hydrant_refill_litres: int = 0
    range_m: float = 50.0
    speed_m: float = 40.0
    """Metres driven in a step."""


@dataclass(frozen=True, kw_only=True)
class Parameters:
    """All parameters of a world."""

    fire: FireParameters = FireParameters()
    health: HealthParameters = HealthParameters()
    brigades: BrigadeParameters = BrigadeParameters()


OFFICIAL_2011: Final = Parameters()
OFFICIAL_2013: Final = replace(
    OFFICIAL_2011,
    brigades=BrigadeParameters(
        tank_litres=15_000, power_litres=3000, refuge_refill_litres=1500, hydrant_refill_litres=400
    ),
)
PAPER: Final = Parameters(
    fire=FireParameters(flush_temperature=0.001),
    health=HealthParameters(initial_hp=1000),
    brigades=BrigadeParameters(
        tank_litres=15_000, power_litres=2000, refuge_refill_litres=1500, hydrant_refill_litres=400, speed_m=80.0
    ),
)
PRESETS: Final = {"official-2011": OFFICIAL_2011, "official-2013": OFFICIAL_2013, "paper": PAPER}
