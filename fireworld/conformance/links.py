"""The radiation links of a trace, for a city that has none of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from fireworld.city.city import Int64Array, Links
from fireworld.city.formats.json_roads import fault_of_links
from fireworld.conformance.arrays import read_arrays

LINK_ARRAYS: Final = ("conn_ptr", "conn_idx", "conn_val")
INDEX_MAX: Final = 2**31 - 1


def load_links(path: Path, building_id: Int64Array) -> Links:
    """Read the links of a city, given the (n,) ids of its buildings; TraceError if the file has none that fit."""
    arrays, n = read_arrays(path, [*LINK_ARRAYS, "id"]), len(building_id)
    if "id" in arrays:
        ids = arrays.integers("id", None, low=0, high=INDEX_MAX)
        if not np.array_equal(ids, building_id):
            arrays.refuse("id", f"the ids of the {n} buildings of the city, in its order", f"{len(ids)} others")
    ptr = arrays.integers("conn_ptr", None, low=0, high=INDEX_MAX)
    building = arrays.integers("conn_idx", None, low=0, high=n - 1)
    share = arrays.floats("conn_val", None)
    arrays.refuse_first("conn_val", ~((share >= 0) & (share <= 1)), "a number from 0 to 1", share)
    links = Links(ptr=ptr.astype(np.int32), building=building.astype(np.int32), share=share.astype(np.float32))
    fault = fault_of_links(links, n)
    if fault is not None:
        key, wanted, got = fault
        arrays.refuse({"ptr": "conn_ptr", "building": "conn_idx", "share": "conn_val"}[key], wanted, got)
    return links
