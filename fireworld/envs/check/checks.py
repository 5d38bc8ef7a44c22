"""What a check is, how it is run, and how its result is written."""

from __future__ import annotations

import contextlib
import io
import re
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from fireworld.errors import described

EXPECTED: Final = {
    "Observation is not a NumPy array": "it is a dictionary, which holds the mask as PettingZoo asks for it",
    "Observation space for each agent probably should be": "the same",
    "space maximum value is infinity": "three features of buildings have no bound",
    "maximum state space value is infinity": "the same",
    "Observation numpy array is all zeros": "a brigade that refills, or has no fire, sees nothing",
    "State numpy array is all zeros": "the same",
    "alternative render modes": "the live view needs a display",
    "different from the unwrapped version": "it is checked as users have it",
}
"""What libraries warn of, in their words, and why that is right here; anything else fails a check."""
COLUMNS: Final = 80
_FORM_WIDTH, _RESULT_WIDTH, _NAME_WIDTH = 10, 6, 34
OK, FAILED = "ok", "FAILED"


@dataclass(frozen=True)
class Check:
    """A check of a form.

    Attributes:
        name: what is checked.
        form: which form.
        run: raises what is wrong; returns what is worth knowing, or "".
    """

    name: str
    form: str
    run: Callable[[], str | None]

    def __str__(self) -> str:
        return f"{self.form}: {self.name}"


@dataclass(frozen=True)
class Checked:
    """What a check came to.

    Attributes:
        name: of the check.
        form: that was checked.
        ok: whether all is right.
        detail: what is worth knowing, or what is wrong.
        seconds: that it took.
    """

    name: str
    form: str
    ok: bool
    detail: str
    seconds: float

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        return asdict(self)


def run_check(check: Check) -> Checked:
    """Run a check; whatever it raises or warns of, unless that is EXPECTED, is what is wrong."""
    start = time.perf_counter()
    ok, detail = True, ""
    with warnings.catch_warnings(record=True) as seen, contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("always")
        try:
            detail = check.run() or ""
        except Exception as error:  # noqa: BLE001 - libraries and forms may raise anything
            ok, detail = False, described(error)
    odd = [text for text in map(_plain, seen) if not any(words in text for words in EXPECTED)]
    if ok and odd:
        ok, detail = False, f"warns: {odd[0]}"
    return Checked(check.name, check.form, ok, detail, round(time.perf_counter() - start, 3))


def table_of(checked: Sequence[Checked]) -> str:
    """Return the results as a table of COLUMNS columns; what is wrong stands below it in full."""
    lines = [_row("check", "form", "result", ""), "─" * COLUMNS]
    lines += [_row(one.name, one.form, OK if one.ok else FAILED, one.detail) for one in checked]
    failed = [one for one in checked if not one.ok]
    lines += ["", f"{len(checked) - len(failed)} of {len(checked)} checks are passed"]
    return "\n".join([*lines, *(f"{one.form}: {one.name}: {one.detail}" for one in failed)])


def _row(name: str, form: str, result: str, detail: str) -> str:
    head = f"{name:<{_NAME_WIDTH}} {form:<{_FORM_WIDTH}} {result:<{_RESULT_WIDTH}} "
    room = COLUMNS - len(head)
    return (head + (detail if len(detail) <= room else f"{detail[: room - 1]}…")).rstrip()


def _plain(warning: warnings.WarningMessage) -> str:
    """Return what is warned of, without the colors of a terminal."""
    return re.sub(r"\x1b\[\d+m", "", str(warning.message))
