"""The data of a page that plays, unpacked here: a second reader of what `columns.py` writes, beside the page's own."""

from __future__ import annotations

import base64
import json
import re
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Unpacked:
    """Words, and the bytes of the columns."""

    words: dict[str, Any]
    content: bytes

    def column(self, name: str) -> np.ndarray:
        """Return a column, (rows, width) float64; NaN where there is no number."""
        offset, rows, width, n_planes, digits, none = self.words["columns"][name]
        size = rows * width
        planes = np.frombuffer(self.content, "u1", n_planes * size, offset).reshape(n_planes, width, rows)
        folded = sum(plane.astype(np.int64) << (8 * k) for k, plane in enumerate(planes))
        whole = np.cumsum((folded >> 1) ^ -(folded & 1), axis=1).T
        return np.where(whole == none, np.nan, whole / 10**digits)


def unpacked(page: str) -> Unpacked:
    (text,) = re.findall(r'<script type="text/plain" id="data">([A-Za-z0-9+/=]*)</script>', page)
    data = zlib.decompress(base64.b64decode(text))
    length = int.from_bytes(data[:4], "little")
    return Unpacked(json.loads(data[4 : 4 + length]), data[4 + length :])
