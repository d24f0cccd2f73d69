"""Faults on purpose: a disturbed use of the project must end complete and identical, or say what is incomplete."""
