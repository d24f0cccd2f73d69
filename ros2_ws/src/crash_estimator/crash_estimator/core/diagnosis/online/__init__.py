"""The same while the samples come."""
