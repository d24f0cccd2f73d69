"""Estimates -> crash_msgs: the one file of the estimator that knows both worlds."""

from array import array
from collections.abc import Sequence

import numpy as np
from builtin_interfaces.msg import Time
from crash_msgs.msg import Event, Forces, Parameters, Residuals

from ..core.estimate import Description, Estimate


class EstimateMessages:
    """Makes the four messages of a block of estimates; names and units are set once."""

    def __init__(self, description: Description):
        self.description = description

    def parameters(self, stamp: Time, run: int, estimates: Sequence[Estimate]) -> Parameters:
        d = self.description
        message = Parameters(name=list(d.parameters), unit=list(d.parameter_units))
        self._head(message, stamp, run, estimates)
        message.value = _rows(estimates, "parameters")
        message.std = _rows(estimates, "std")
        message.status = _bytes(estimates, "status")
        return message

    def residuals(self, stamp: Time, run: int, estimates: Sequence[Estimate]) -> Residuals:
        d = self.description
        message = Residuals(name=list(d.equations), unit=list(d.equation_units))
        self._head(message, stamp, run, estimates)
        for field in ("measured", "predicted", "innovation", "residual", "residual_std"):
            setattr(message, field, _rows(estimates, field))
        variances = np.array([np.diagonal(estimate.innovation_covariance) for estimate in estimates])
        message.innovation_std = array("d", np.sqrt(variances).tobytes())
        return message

    def forces(self, stamp: Time, run: int, estimates: Sequence[Estimate]) -> Forces:
        d = self.description
        message = Forces(element=list(d.elements), between=["-".join(ends) for ends in d.between], body=list(d.bodies))
        self._head(message, stamp, run, estimates)
        message.mass = array("d", d.masses)
        for field in ("crush", "rate", "force", "force_std", "displacement", "velocity", "acceleration"):
            setattr(message, field, _rows(estimates, field))
        message.state = _bytes(estimates, "state")
        return message

    def events(self, stamp: Time, run: int, estimate: Estimate) -> list[Event]:
        messages = []
        for event in estimate.events:
            message = Event(run=run, number=estimate.number, time=estimate.time_ns * 1e-9, **event._asdict())
            message.header.stamp = stamp
            messages.append(message)
        return messages

    def _head(self, message, stamp: Time, run: int, estimates: Sequence[Estimate]) -> None:
        message.header.stamp = stamp
        message.run = run
        message.number = estimates[0].number
        message.time_ns = array("q", [estimate.time_ns for estimate in estimates])
        message.model = self.description.model
        message.method = self.description.method


def _rows(estimates: Sequence[Estimate], field: str) -> array:
    """A (p,) field of n estimates as one row-major array of n * p doubles."""
    return array("d", b"".join(getattr(estimate, field).tobytes() for estimate in estimates))


def _bytes(estimates: Sequence[Estimate], field: str) -> array:
    return array("B", b"".join(getattr(estimate, field).tobytes() for estimate in estimates))
