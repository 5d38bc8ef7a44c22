"""The key `observation` of a scenario: what brigades see, where it is not as in the model."""

from __future__ import annotations

from typing import Annotated, Final, Literal, get_args

from msgspec import Meta, Struct

Fraction = Annotated[float, Meta(ge=0, le=1)]
Metres = Annotated[float, Meta(ge=0, le=1e6)]
Flags = Literal["action", "target", "spraying"]
FLAGS: Final[tuple[Flags, ...]] = get_args(Flags)
"""In the order of the kernels' numbers."""


class Observed(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What brigades see, where it is not as in the model; null is as there."""

    flags_of: Annotated[
        Literal["others", "all"] | None,
        Meta(description="Whose doings the four flags tell: the `others`'; or of `all`, the brigade itself included."),
    ] = None
    flags: Annotated[
        Flags | None,
        Meta(
            description="What they tell: `action`, one does this action; `target`, one goes for the building that the "
            "action would name for this brigade; `spraying`, and has sprayed in the last step."
        ),
    ] = None
    free_edges: Annotated[
        Literal["linked", "city", "streets"] | None,
        Meta(
            description="Which sides of a site are free: `linked`, a building that radiation reaches and that never "
            "burned lies beyond; `city`, any building that can burn; `streets`, one as for `linked` whose box is less "
            "than 10 m from the site's, since fire does not jump a wider street."
        ),
    ] = None
    easiest: Annotated[
        Literal["burning", "heated"] | None,
        Meta(
            description="Among which buildings `easiest` chooses the coolest: the site's that are `burning`; or those "
            "`heated` too, which radiation of the site reaches and that are at least half as hot as they catch fire."
        ),
    ] = None
    center_shares: Annotated[
        tuple[Fraction, Fraction] | None,
        Meta(description="Thresholds of the distance from the centre, of half the city's diagonal; null: 1/3 and 2/3."),
    ] = None
    civilian_m: Annotated[
        tuple[Metres, Metres] | None, Meta(description="Thresholds of the distance from a civilian; null: 30 and 80.")
    ] = None
    volume_growth: Annotated[
        Annotated[float, Meta(gt=1, le=100)] | None,
        Meta(description="How many times a threshold of the volume is the one before; null: 2."),
    ] = None
