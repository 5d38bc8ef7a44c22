"""XML as a stream of elements: no document types, no entities, bounded in size; every mistake in one line.

A document type is refused as a whole. So there are no entities to expand, and nothing outside the file is read.
"""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Callable
from typing import Any, Final, Never
from xml.parsers import expat

from fireworld.errors import CityError, expected

SIZE_MAX_BYTES: Final = 1_000_000_000
"""Of a file as it is when unpacked: more than a hundred thousand buildings take."""
DIGITS_MAX: Final = 20
CHUNK_BYTES: Final = 1 << 20
GZIP_MAGIC: Final = b"\x1f\x8b"

Attributes = dict[str, str]
Started = Callable[[str, Attributes], None]


class XmlStream:
    """Reads one XML file; names are "namespace name", those without a namespace the name alone.

    Args:
        where: the file, named in errors.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self._parser: Any = expat.ParserCreate(namespace_separator=" ")
        self._parser.buffer_text = True
        self._parser.StartDoctypeDeclHandler = self._refuse_doctype
        self._text: list[str] = []

    def read(
        self, content: bytes, *, root: str, what: str, started: Started, ended: Callable[[str], None] | None = None
    ) -> None:
        """Read a file's content, packed by gzip or not, and call `started` for each element, `ended` for its end.

        Args:
            content: of the file.
            root: name of the first element.
            what: the kind of file, for the error about another root.
            started: called with name and attributes of every element below the root.
            ended: called with the name of every element.

        Raises:
            CityError: no well-formed XML, a document type, damaged or endless gzip.
        """

        def first(name: str, _: Attributes) -> None:
            if name != root:
                self.refuse("", f"{what}, root element {named(root)}", named(name))
            self._parser.StartElementHandler = started  # called by expat itself from here on, which is faster

        self._parser.StartElementHandler, self._parser.EndElementHandler = first, ended
        try:
            self._feed(content)
        except expat.ExpatError as error:
            got = f"{expat.ErrorString(error.code)} at line {error.lineno}, column {error.offset + 1}"
            raise CityError(expected(self.where, "", "well-formed XML", got)) from None
        except (OSError, EOFError, zlib.error) as error:
            raise CityError(expected(self.where, "", "a whole gzip file", str(error) or "a damaged one")) from None
        finally:
            self._parser.StartElementHandler = self._parser.EndElementHandler = None

    def collect_text(self) -> None:
        """Keep the text from here on, until `text` is asked for."""
        self._text = []
        self._parser.CharacterDataHandler = self._text.append

    def text(self) -> str:
        """Return the text since `collect_text`, and keep no more."""
        self._parser.CharacterDataHandler = None
        return "".join(self._text)

    def refuse(self, key: str, wanted: str, got: object, hint: str = "") -> Never:
        """Raise CityError for what was just read; it names the line."""
        line = f"line {self._parser.CurrentLineNumber}"
        raise CityError(expected(self.where, f"{line}: {key}" if key else line, wanted, got, hint))

    def whole(self, what: str, key: str, text: str | None, *, low: int = 0, high: int) -> int:
        """Return the whole number that an attribute of an element holds; CityError if it is none, or out of bounds."""
        number = int(text) if text is not None and text.isdecimal() and len(text) < DIGITS_MAX else -1
        if not low <= number <= high:
            wanted = f"a whole number from {low} to {high}"
            self.refuse(f"{what}: {key}", wanted, "no value" if text is None else text)
        return number

    def _refuse_doctype(self, name: str, *_: object) -> None:
        self.refuse("", "XML without a document type and entities", f"<!DOCTYPE {name}>")

    def _feed(self, content: bytes) -> None:
        packed = content.startswith(GZIP_MAGIC)
        source: Any = gzip.GzipFile(fileobj=io.BytesIO(content)) if packed else io.BytesIO(content)
        size = 0
        while chunk := source.read(CHUNK_BYTES):
            size += len(chunk)
            if size > SIZE_MAX_BYTES:
                wanted = f"at most {SIZE_MAX_BYTES} bytes of XML"
                raise CityError(expected(self.where, "", wanted, "more of them when unpacked" if packed else "more"))
            self._parser.Parse(chunk, False)
        self._parser.Parse(b"", True)


def named(name: str) -> str:
    """Write the name of an element for people."""
    namespace, _, local = name.rpartition(" ")
    return f"{local} in {namespace}" if namespace else f"{local} in no namespace"
