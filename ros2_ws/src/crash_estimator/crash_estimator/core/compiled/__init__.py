"""The same recursion as the numpy form beside it, compiled: for real time at 10 kHz and for whole records.

The numpy form (`kinematics`, `contact`, `regression`, `estimators`) is the one to read, and the oracle that the
tests hold this one against at every sample.
"""

from .. import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined
