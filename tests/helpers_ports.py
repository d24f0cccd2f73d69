"""Which sockets a process and its children have, from /proc."""

import ipaddress
import os
import sys
from pathlib import Path

from helpers_nodes import family


def bound(process: int) -> set[tuple[str, str, int]]:
    """(protocol, address, port) of every socket of the process and its children that takes what comes from outside."""
    inodes = set()
    for one in family(process):
        for descriptor in Path(f"/proc/{one}/fd").glob("*"):
            try:
                inodes.add(os.readlink(descriptor))
            except OSError:
                continue  # closed meanwhile
    found = set()
    for protocol in ("udp", "udp6", "tcp", "tcp6"):
        for line in Path(f"/proc/net/{protocol}").read_text().splitlines()[1:]:
            _, local, _, state, *_, inode = line.split()[:10]
            listens = not protocol.startswith("tcp") or state == "0A"
            if listens and f"socket:[{inode}]" in inodes:
                address, port = local.split(":")
                found.add((protocol, str(ip_address(address)), int(port, 16)))
    return found


def ip_address(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    """As /proc/net writes it: words of 32 bits in the machine's own order of bytes."""
    words = [int(text[k : k + 8], 16).to_bytes(4, sys.byteorder) for k in range(0, len(text), 8)]
    return ipaddress.ip_address(b"".join(words))


def elsewhere(sockets: set[tuple[str, str, int]]) -> set[tuple[str, str, int]]:
    return {one for one in sockets if not ipaddress.ip_address(one[1]).is_loopback}
