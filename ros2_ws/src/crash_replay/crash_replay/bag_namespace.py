"""Which replay's topics are read from a bag: they may have been recorded in a namespace, and several in one bag.

Of a bag with several one is read at a time: two.mcap#sled_a names the test of the namespace /sled_a in it, two.mcap#/
that of the replay that had none.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from .recording import RecordingError

if TYPE_CHECKING:
    from .bag_contents import Topic  # with decoders, which who only parts a name need not load

TEST_TOPIC, TEST_TYPE = "/test", "crash_msgs/msg/TestInfo"


def parted(source: str | Path) -> tuple[Path, str | None]:
    """The file or folder, and the namespace that is asked for behind a `#`: "" for the root, None where none is."""
    path = Path(source)
    before, mark, namespace = str(source).rpartition("#")
    if not mark or path.exists():
        return path, None
    return Path(before), f"/{namespace.strip('/')}".rstrip("/")


def is_read(topic: str) -> bool:
    """Whether a topic may hold something of a test, in whichever namespace."""
    return topic.endswith((TEST_TOPIC, "/samples")) or "/channels/" in topic


def own_topics(path: Path, topics: "Mapping[str, Topic]", wanted: str | None) -> "tuple[str, dict[str, Topic]]":
    """The namespace that is read, and its topics by their names without it.

    wanted: as `parted` gives it. Raises RecordingError where that is not there, or where several are and none is said.
    """
    tests = {name: topic for name, topic in topics.items() if name.endswith(TEST_TOPIC) and topic.type == TEST_TYPE}
    found = sorted(name.removesuffix(TEST_TOPIC) for name in tests)
    ways = ", ".join(f"{path}#{namespace.strip('/') or '/'}" for namespace in found)
    if wanted is not None and wanted not in found:
        raise RecordingError(f"{path}: no test of the namespace {wanted or '/'} is in it; there are: {ways or 'none'}")
    if wanted is None and len(found) > 1:
        raise RecordingError(f"{path}: holds tests of {len(found)} namespaces; say which one: {ways}")
    namespace = wanted if wanted is not None else (found or [""])[0]
    return namespace, {n.removeprefix(namespace): topic for n, topic in topics.items() if n.startswith(f"{namespace}/")}
