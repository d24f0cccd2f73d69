"""Input that is wrong on purpose: whatever comes, it is taken or refused with one line (`make fuzz`)."""
