"""Keys of the official program's configuration, and the parameters that they set."""

from __future__ import annotations

from typing import Final

PREFIX: Final = "resq-fire."
FIRE_KEYS: Final = {
    **{
        f"{theirs}_{their_name}": f"{name}_{material}"
        for their_name, name in (
            ("energy", "fuel_density"),
            ("capacity", "heat_capacity"),
            ("ignition", "ignition_point"),
        )
        for theirs, material in (("wooden", "wood"), ("steel", "steel"), ("concrete", "concrete"))
    },
    "cell_size": "air_cell_mm",
    "air_to_air_flow": "air_to_air_flow",
    "air_to_building_flow": "air_to_building_flow",
    "air_cell_heat_capacity": "air_heat_capacity",
    "energy_loss": "air_heat_kept",
    "radiation_coefficient": "radiation_coefficient",
    "water_thermal_capacity": "water_heat_per_litre",
    "gamma": "water_unburnt_share",
}
"""Parameter of each key, without its prefix: those that every fire needs."""
BURN_KEYS: Final = {"burn-rate-average": "burn_rate_mean", "burn-rate-variance": "burn_rate_sd"}
"""The official "variance" is a standard deviation."""
RAY_KEYS: Final = {"ray_rate": "ray_rate_per_mm", "max_ray_distance": "ray_range_mm"}
BRIGADE_KEYS: Final = {
    "water_capacity": "tank_litres",
    "max_extinguish_power_sum": "power_litres",
    "water_refill_rate": "refuge_refill_litres",
    "water_hydrant_refill_rate": "hydrant_refill_litres",
    "water_distance": "range_m",
}
MILLIMETRES: Final = {"range_m": 1000.0}
"""Parameters that the configuration gives in a smaller unit."""
HEALTH_KEYS: Final = {
    "misc.injury.fire.slight": "slight_damage",
    "misc.injury.fire.serious": "serious_damage",
    "misc.injury.fire.critical": "critical_damage",
    "misc.injury.fire.wood.none.slight": "slight_probability",
    "misc.injury.fire.wood.none.serious": "serious_probability",
    "misc.injury.fire.wood.none.critical": "critical_probability",
    "misc.injury.fire.k": "growth",
    "misc.injury.fire.l": "constant",
    "misc.injury.fire.noise.mean": "noise_mean",
    "misc.injury.fire.noise.sd": "noise_sd",
    "misc.injury.fire.multiplier.fire": "brigade_share",
}
"""Parameter of each whole key. Of the probabilities, which the official program has for each material and degree of
collapse, fireworld has one set."""
SYNONYMS: Final = {
    "water_capacity": "fire.tank.maximum",
    "water_refill_rate": "fire.tank.refill_rate",
    "water_hydrant_refill_rate": "fire.tank.refill_hydrant_rate",
    "water_distance": "fire.extinguish.max-distance",
    "max_extinguish_power_sum": "fire.extinguish.max-sum",
}
"""The second name of a key, without the prefix; agents read that one."""
STEPS_KEY: Final = "kernel.timesteps"
INFLAMMABLE_KEYS: Final = {
    "refuge": "refuge_inflammable",
    "firestation": "fire_station_inflammable",
    "policeoffice": "police_office_inflammable",
    "ambulancecentre": "ambulance_center_inflammable",
}
"""What makes a kind of building inflammable, as the official program reads it; they are not by default."""
