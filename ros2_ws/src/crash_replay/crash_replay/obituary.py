"""Tells the middleware that a process has been killed, which it would only find out when the lease ends.

A participant that ends says so itself, with a disposal of its own data (RTPS 2.2, 8.5.3.2); one that is killed cannot,
and until its lease is over every reliable publisher waits for it to take what was sent. A short lease would drop
processes that are merely stopped, too, and with them what is on its way to them; so the lease is long, and who finds
a process of this machine gone says its last word in its place. On a secured graph it is not believed: there the lease
has to end.
"""

import socket
import struct

LOOPBACK = "127.0.0.1"
PARTICIPANTS = 120
"""Of one domain on one machine: as many as have ports of their own before those of the next domain (RTPS 2.2,
9.6.1.4)."""
PROTOCOL, VENDOR = b"RTPS\x02\x03", b"\x01\x0f"
PARTICIPANT, ANNOUNCER, LISTENER = b"\x00\x00\x01\xc1", b"\x00\x01\x00\xc2", b"\x00\x01\x00\xc7"
"""Entities of each participant: itself, what it announces itself with, and hears others with (RTPS 2.2, table 9.2)."""
DATA, LITTLE_ENDIAN_WITH_QOS = 0x15, 0x03
KEY_HASH, STATUS_INFO, SENTINEL = 0x0070, 0x0071, 0x0001
DISPOSED_AND_UNREGISTERED = b"\x00\x00\x00\x03"
LAST = 0x7FFF_FFFF
"""Sequence number: an announcement that is older than the last one is left out."""


def discovery_port(domain: int, participant: int) -> int:
    """Where a participant hears announcements: RTPS 2.2, 9.6.1.1."""
    return 7400 + 250 * domain + 10 + 2 * participant


def disposal(participant: bytes) -> bytes:
    """The message that a participant (the first 12 bytes of its GUID) is no more."""
    status = struct.pack("<HH", STATUS_INFO, 4) + DISPOSED_AND_UNREGISTERED + struct.pack("<HH", SENTINEL, 0)
    parameters = struct.pack("<HH", KEY_HASH, 16) + participant + PARTICIPANT + status
    content = struct.pack("<HH", 0, 16) + LISTENER + ANNOUNCER + struct.pack("<iI", 0, LAST) + parameters
    return PROTOCOL + VENDOR + participant + struct.pack("<BBH", DATA, LITTLE_ENDIAN_WITH_QOS, len(content)) + content


def announce_end(participant: bytes, domain: int) -> None:
    """Tell all of this machine who are on the domain that a participant's process runs no more."""
    message = disposal(participant)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for k in range(PARTICIPANTS):
            try:
                sender.sendto(message, (LOOPBACK, discovery_port(domain, k)))
            except OSError:  # nobody is there
                pass
