"""Tests of NHTSA's public crash test database by their number: `nhtsa:10146` wherever a recording is taken."""
