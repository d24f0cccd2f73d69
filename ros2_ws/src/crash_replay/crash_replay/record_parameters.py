"""The parameters of `record`, with what they mean and may be."""

from .node_parameters import Allowed

PARAMETERS = {
    "to": Allowed("", "the file to write, which must not exist: *.mcap", needed="-p to:=estimates.mcap"),
    "wait_for": Allowed(1, "estimators to hear before the samples", 0, 1000),
    "topics": Allowed(
        [""], "names or patterns such as /kalman/*; none: all but channels/*, /clock and what is said by name"
    ),
    "exclude": Allowed([""], "topics to leave out, names or patterns"),
}
