"""What is done to a valid input: numbers out of range, parts gone, doubled or swapped, bytes that are others."""

import re
import struct
from array import array
from copy import deepcopy
from random import Random
from typing import Any

from rclpy.serialization import serialize_message

from crash_replay.cdr import NUMBERS as SERIALIZED
from crash_replay.cdr import PLAIN, aligned

from .valid import Files

SIZES = {"boolean": 1} | {kind: int(name[-1]) for kind, name in SERIALIZED.items()}
"""Bytes of a number."""

NUMBERS = (
    "0", "-0", "-1", "1", "1e10", "-1e10", "1e30", "1e100", "1e308", "-1e308", "1e309", "1e-308", "5e-324", "nan",
    "inf",
    "-inf", ".nan", ".inf", "9223372036854775807", "9223372036854775808", "-9223372036854775808",
    "18446744073709551615",
    "2147483647", "2147483648", "4294967295", "0x10", "1_000", "1,5", "", " ", "true", "1" * 400, "1" * 5000, "0.1.2",
    "+",
)  # fmt: skip
WORDS = (
    "", "null", "~", "true", "false", "yes", "no", "[]", "{}", "[a, a]", "{a: 1}", "[" * 50, "[" * 3000, "{a: " * 100,
    "*none", "&a [*a]", "!!binary a", "!!python/object/apply:os.system [ls]", "!!float x", "!!timestamp 2001-99-99",
    "2001-01-01",
    "\\x1b[2J", "\x1b[31m", "\x00", "\u202e", "\ud800", "\ufeff", "'", '"', "|", ">", "#", ":", "- ", "<<: *a", "? ",
    "%", "@", "`",
    "x" * 200, "x" * 20_000, "ü", "名", "../../etc/passwd", "/dev/zero", "a b", "a-b", "__", "1a", "NOVALUE", "time",
    "car", "rib_ay",
    "X0: &X0 [a,a,a,a,a,a,a,a,a]\nX1: &X1 [*X0,*X0,*X0,*X0,*X0,*X0,*X0,*X0,*X0]\n"
    "X2: [*X1,*X1,*X1,*X1,*X1,*X1,*X1,*X1,*X1]",
    "&b [&c [&d [1,1,1,1],*d,*d,*d],*c,*c,*c,*c]",
)  # fmt: skip
PYTHON = (
    "sys.exit()", "sys.exit(0)", "raise SystemExit", "1 / 0", "raise KeyError('x')", "np.nan", "None", "'x'", "[]",
    "{}", "object()",
    "motion.rate[:3]", "np.full(64, np.inf)", "10.0**400", "time", "np.zeros((2, 2))", "1j * motion.rate",
    "lambda: 0", "5", "-1.0",
    "[] * 3", "rate ** 0.5", "force(motion)", "float('nan')", "exit()", "np.ones(10**6)", "(yield)",
    "open('/nonexistent')",
)  # fmt: skip
TOKEN = re.compile(r"[-+]?\d[\d.eE+-]*|[A-Za-z_][\w']*|[^\w\s]|\s+")
BYTES = (b"\x00", b"\xff", b"\xff\xfe", b"\xc3\x28", b"\r", b"\n", b"\x1a", b"\x1b[2J", b"\x80" * 50)
INTEGERS = (
    0,
    1,
    -1,
    2**31 - 1,
    -(2**31),
    2**31,
    2**32 - 1,
    2**63 - 1,
    -(2**63),
    2**63,
    2**64 - 1,
    10**12,
    10**8,
    10**7 + 1,
)
FLOATS = (
    0.0,
    -1.0,
    1.0,
    float("nan"),
    float("inf"),
    -float("inf"),
    1e308,
    -1e308,
    5e-324,
    1e12,
    1e13,
    1e100,
    1e-9,
    1e4,
)


def spoilt(rng: Random, files: Files, words: tuple[str, ...] = WORDS) -> Files:
    """Some of the files changed in one to four ways."""
    files = dict(files)
    for _ in range(rng.choice((1, 1, 1, 2, 2, 4))):
        if not files:
            break
        name = rng.choice(list(files))
        if rng.random() < 0.03:
            _misplaced(rng, files, name)
        elif rng.random() < 0.1:
            files[name] = spoilt_bytes(rng, files[name])
        else:
            files[name] = spoilt_text(rng, files[name], words)
    return files


def _misplaced(rng: Random, files: Files, name: str) -> None:
    """Something else where the file is expected, or nothing; see `worker.laid_out` for the names."""
    content = files.pop(name)
    kind = rng.choice(("gone", "empty", "folder", "pipe", "device", "doubled"))
    if kind == "doubled":
        files |= {name: content, name + rng.choice(("x", ".EV5", ".mme", ".mcap", ".001")): content}
    elif kind != "gone":
        files[name + {"empty": "", "folder": "/", "pipe": "|", "device": "@"}[kind]] = b""


def spoilt_text(rng: Random, content: bytes, words: tuple[str, ...] = WORDS) -> bytes:
    if rng.random() < 0.25:
        return _spoilt_lines(rng, content)
    tokens = TOKEN.findall(content.decode("latin-1"))
    if not tokens:
        return rng.choice(BYTES)
    for _ in range(rng.choice((1, 1, 2, 5))):
        k = rng.randrange(len(tokens))
        numbers = [k for k, token in enumerate(tokens) if token[-1:].isdigit()]
        match rng.randrange(7):
            case 0 | 1 | 2 if numbers:
                tokens[rng.choice(numbers)] = rng.choice(NUMBERS)
            case 3:
                tokens[k] = rng.choice(words)
            case 4:
                tokens[k] = tokens[rng.randrange(len(tokens))]
            case 5:
                tokens[k] = ""
            case _:
                tokens.insert(k, rng.choice(words))
    return "".join(tokens).encode("utf-8", "surrogatepass")


def _spoilt_lines(rng: Random, content: bytes) -> bytes:
    lines = content.split(b"\n")
    k, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(6):
        case 0:
            del lines[k]
        case 1:
            lines.insert(k, lines[other])
        case 2:
            lines[k], lines[other] = lines[other], lines[k]
        case 3:
            lines[k:] = lines[k : k + 1] * rng.choice((2, 50, 2000))
        case 4:
            lines[k] = lines[k] * rng.choice((2, 100, 3000))
        case _:
            lines[k] = lines[k].replace(
                rng.choice((b"|", b",", b":", b" ")), rng.choice((b"", b"|", b",,", b"::", b"\t"))
            )
    return b"\n".join(lines)


def spoilt_bytes(rng: Random, original: bytes) -> bytes:
    content = bytearray(original)
    for _ in range(rng.choice((1, 1, 2, 8))):
        k = rng.randrange(len(content) + 1)
        match rng.randrange(6):
            case 0:
                content[k : k + 1] = bytes([rng.randrange(256)])
            case 1:
                del content[k:]
            case 2:
                content[k:k] = rng.choice(BYTES)
            case 3:
                content[k : k + 8] = struct.pack("<Q", rng.choice(INTEGERS) % 2**64)
            case 4:
                at = k - k % 4  # where CDR has its lengths
                content[at : at + 4] = struct.pack("<I", rng.choice(INTEGERS) % 2**32)
            case _:
                content[k : k + rng.randrange(1, 40)] = b""
    return bytes(content)


def spoilt_message(rng: Random, message: Any) -> bytes:
    """Its bytes, with a field that says something else, or with bytes that are others."""
    message = deepcopy(message)
    for _ in range(rng.choice((0, 1, 1, 2, 4))):
        _spoil_field(rng, message)
    raw = serialized(message)
    if rng.random() < 0.25:
        raw = spoilt_bytes(rng, raw)
    if rng.random() < 0.02:
        raw = rng.randbytes(rng.choice((0, 1, 4, 40, 4000)))
    return raw


def serialized(message: Any) -> bytes:
    """Its bytes, with zeros where the next number or text begins at a multiple of its size: rclpy leaves there what the
    memory held, and a seed is to make the same input again."""
    raw = bytearray(serialize_message(message))
    _zero_gaps(message, raw, len(PLAIN))
    return bytes(raw)


def _zero_gaps(message: Any, raw: bytearray, at: int) -> int:
    """Of a message that begins at `at` -> where it ends."""

    def at_multiple_of(size: int) -> int:
        begins = aligned(at, size)
        raw[at:begins] = bytes(begins - at)
        return begins

    for field, kind in message.get_fields_and_field_types().items():
        elements = [getattr(message, field)]
        if kind.startswith("sequence<"):
            kind, (elements,) = kind.removeprefix("sequence<").removesuffix(">"), elements
            at = at_multiple_of(4) + 4
        for element in elements:
            if kind == "string":
                at = at_multiple_of(4) + 4 + len(element.encode()) + 1
            elif "/" in kind:
                at = _zero_gaps(element, raw, at)
            else:
                at = at_multiple_of(SIZES[kind]) + SIZES[kind]
    return at


def _spoil_field(rng: Random, message: Any) -> None:
    field, kind = rng.choice(list(message.get_fields_and_field_types().items()))
    value = getattr(message, field)
    setattr(message, field, _other(rng, kind, value))


def _other(rng: Random, kind: str, value: Any) -> Any:
    if kind.startswith("sequence<"):
        items = list(value)
        k = rng.randrange(len(items) + 1)
        change = rng.randrange(4)
        if change == 0:
            items = items[:k]
        elif change == 1:
            items = items + items[:k] + items
        elif items:
            k = min(k, len(items) - 1)
            inner = kind.removeprefix("sequence<").removesuffix(">")
            items[k] = items[0] if change == 2 else _other(rng, inner, items[k])
        return array(value.typecode, items) if isinstance(value, array) else items
    if kind == "string":
        return rng.choice(("", "a", "x" * 20_000, "\x1b[2J", "ü", "a b", "acceleration", "car_ax", "x\ny"))
    if kind in ("double", "float"):
        return rng.choice(FLOATS)
    if kind == "boolean":
        return not value
    if "/" in kind:
        _spoil_field(rng, value)
        return value
    bits = int(kind.lstrip("uint"))
    number = rng.choice(INTEGERS) % 2**bits
    return number - 2**bits if kind[0] == "i" and number >= 2 ** (bits - 1) else number
