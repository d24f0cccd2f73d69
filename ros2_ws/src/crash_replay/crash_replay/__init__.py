"""Recorded crash tests: read, simulated, replayed and recorded on ROS 2; see the README."""

from .starting import begin_program

begin_program(__name__, __path__[0])  # before anything that takes time to import
