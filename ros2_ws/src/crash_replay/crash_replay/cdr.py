"""A serialised message whose texts and lengths stay while its numbers are written anew, where they lie.

For rclpy to look at every field of a message, to make C's form of it and to serialise that takes some 20 us, most of it
for texts that are always the same: where thousands of messages go out in a second, they are filled in instead.

A number of n bytes lies at a multiple of n behind the 4 bytes that name the encoding; a text is its length, its bytes
and a 0; a sequence is its length and its elements (plain CDR: OMG CORBA 3.3, part 2, 9.3; little-endian here).
"""

import struct
from typing import Any

import numpy as np
from rclpy.serialization import serialize_message

from .time_unit import SECOND

PLAIN = bytes([0, 1, 0, 0])
"""Plain CDR, little-endian: what a message begins with (RTPS 2.2, 10.2.1.2)."""
NUMBERS = {"uint8": "u1", "int32": "<i4", "uint32": "<u4", "int64": "<i8", "uint64": "<u8", "double": "<f8"}
STAMP = struct.Struct("<iI")


def aligned(at: int, size: int) -> int:
    """The first multiple of `size` from `at` on, counted from behind the name of the encoding."""
    return at + (len(PLAIN) - at) % size


class Serialized:
    """Bytes of a message; `numbers` are views into them, by field: "number", "header.stamp.sec", "entries[2].value"."""

    def __init__(self, message: Any):
        self._bytes = bytearray(serialize_message(message))
        if self._bytes[: len(PLAIN)] != PLAIN:
            raise ValueError(f"{type(message).__name__}: expected plain CDR, found {self._bytes[: len(PLAIN)].hex()}")
        self.numbers: dict[str, np.ndarray] = {}
        end = self._find(message, "", len(PLAIN))
        self._whole = memoryview(self._bytes)[:end]  # rclpy leaves room behind it

    def _find(self, message: Any, prefix: str, at: int) -> int:
        """Where the numbers of a message that begins at `at` are -> where it ends."""
        for field, kind in message.get_fields_and_field_types().items():
            elements, many = [getattr(message, field)], kind.startswith("sequence<")
            if many:
                kind, elements = kind.removeprefix("sequence<").removesuffix(">"), elements[0]
                at = aligned(at, 4) + 4
            if kind in NUMBERS:
                number = np.dtype(NUMBERS[kind])
                at = aligned(at, number.itemsize) if len(elements) else at
                self.numbers[prefix + field] = np.frombuffer(self._bytes, number, len(elements), at)
                at += number.itemsize * len(elements)
            elif kind == "string":
                for text in elements:
                    at = aligned(at, 4) + 4 + len(text.encode()) + 1
            else:
                for k, element in enumerate(elements):
                    at = self._find(element, f"{prefix}{field}{f'[{k}]' * many}.", at)
        return at

    def set_stamp(self, time_ns: int) -> None:
        """Of a message that begins with a header."""
        STAMP.pack_into(self._bytes, len(PLAIN), *divmod(time_ns, SECOND))

    def __bytes__(self) -> bytes:
        return bytes(self._whole)
