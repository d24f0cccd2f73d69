"""Which topics `record` takes: by names and patterns, by namespace, by regular expressions."""

from crash_replay.recorded_topics import FORCES, SAMPLES, Choice


def test_the_choice_of_topics():
    accel, clock = "geometry_msgs/msg/AccelStamped", "rosgraph_msgs/msg/Clock"
    assert Choice().wants("/samples", SAMPLES)
    assert not Choice().wants("/channels/rib_ay", accel) and not Choice().wants("/clock", clock)
    every = Choice(topics=["*"], exclude=["/kalman/*"])
    assert every.wants("/channels/rib_ay", accel) and every.wants("/clock", clock)
    assert not every.wants("/other", accel) and not every.wants("/strings", "std_msgs/msg/String")
    assert not every.wants("/kalman/forces", FORCES) and every.wants("/mrls/forces", FORCES)
    assert Choice(topics=["channels/rib_*"]).wants("/channels/rib_ay", accel)


def test_the_choice_keeps_to_its_namespace_unless_a_topic_is_named_in_full():
    choice = Choice(topics=["samples", "kalman/*", "/sled_b/samples"], namespace="/sled_a")
    assert choice.wants("/sled_a/samples", SAMPLES) and choice.wants("/sled_a/kalman/forces", FORCES)
    assert choice.wants("/sled_b/samples", SAMPLES, own=False)
    assert not choice.wants("/sled_b/kalman/forces", FORCES, own=False)
    assert not Choice(topics=["*"]).wants("/sled_b/samples", SAMPLES, own=False)
    assert not Choice().wants("/sled_b/samples", SAMPLES, own=False)


def test_the_choice_by_regular_expressions():
    accel = "geometry_msgs/msg/AccelStamped"
    choice = Choice(topics=["samples"], namespace="/a", regex="rib_.*$", exclude_regex="vy")
    assert choice.wants("/a/samples", SAMPLES) and choice.wants("/a/channels/rib_ay", accel)
    assert not choice.wants("/a/channels/rib_vy", accel) and not choice.wants("/a/kalman/forces", FORCES)
    assert not choice.wants("/b/channels/rib_ay", accel, own=False)
