"""The parameters of `record`, with what they mean and may be."""

from .node_parameters import Allowed

PARAMETERS = {
    "to": Allowed("", "the file to write, which must not exist: *.mcap", needed="-p to:=estimates.mcap"),
    "wait_for": Allowed(1, "estimators to hear before the samples", 0, 1000),
    "topics": Allowed(
        [""],
        "names or patterns such as kalman/*, or /sled_b/kalman/* of another namespace; none: all of its own but "
        "channels/*, /clock and what is said by name",
    ),
    "exclude": Allowed([""], "topics to leave out, names or patterns"),
    "regex": Allowed("", "regular expression: topics of its namespace in whose name it is found, too"),
    "exclude_regex": Allowed("", "regular expression of topics to leave out"),
}
