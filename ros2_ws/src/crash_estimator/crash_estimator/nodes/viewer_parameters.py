"""The parameters of `viewer`, with what they mean and may be."""

from crash_replay.node_parameters import NAME, Allowed

PARAMETERS = {
    "estimators": Allowed([""], "names of estimators; empty: all in its namespace", pattern=NAME),
    "models": Allowed([""], "files of models other than the ready ones, for the validation"),
    "port": Allowed(9876, "of the gRPC server on 127.0.0.1 that viewers connect to; 0: a free one", 0, 65_535),
    "rrd": Allowed("crash.rrd", "file that the recording is written to; empty: none"),
    "memory_limit": Allowed(
        "1GiB",
        "what the server keeps for viewers that come late, such as 500MB or 10%",
        pattern=r"\d{1,6}(%|[kMGT]i?B|B)",
    ),
    "open": Allowed(True, "open the native viewer where there is a display"),
    "web": Allowed(False, "where there is no display, serve Rerun's web viewer on 127.0.0.1"),
    "web_port": Allowed(9090, "of the web viewer; 0, or one in use: a free one is taken", 0, 65_535),
    "exit_when_finished": Allowed(False, "end with the replay"),
}
