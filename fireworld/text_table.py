"""Tables in plain text, as wide as their widest cells, for what an object prints of itself."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def text_table(heads: Sequence[str], rows: Iterable[Sequence[str]], align: str) -> str:
    """Return a table as lines of text.

    Args:
        heads: of the columns.
        rows: cells; a row may be shorter than the heads, and a row of one cell may run over all columns.
        align: a character for each column: < to the left, > to the right.
    """
    lines = [heads, *rows]
    whole = [line for line in lines if len(line) > 1]
    widths = [max(len(line[k]) for line in whole if k < len(line)) for k in range(len(heads))]

    def write(line: Sequence[str]) -> str:
        if len(line) == 1:
            return line[0]
        return "  ".join(f"{cell:{align[k]}{widths[k]}}" for k, cell in enumerate(line)).rstrip()

    head, *body = map(write, lines)
    return "\n".join([head, "-" * (sum(widths) + 2 * (len(widths) - 1)), *body])
