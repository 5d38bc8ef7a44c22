"""What tests of forms need: `pytestmark = needs_extra()` leaves them out with a line where it is missing."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

MISSING = [name for name in ("gymnasium", "pettingzoo") if find_spec(name) is None]


def needs_extra() -> pytest.MarkDecorator:
    return pytest.mark.skipif(bool(MISSING), reason=f"{', '.join(MISSING)}: pip install 'fireworld[gym]'")
