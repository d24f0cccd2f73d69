"""Parameter identification of crash models, live and offline; see the README."""

import os

from crash_replay.starting import begin_program

begin_program(__name__, __path__[0])  # before anything that takes time to import

# OpenBLAS reads it when numpy is first imported. The matrices here are small: more threads only wait for each other,
# a diagnosis then takes twice as long on an idle machine and ten times on a busy one.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
