"""Parameter identification of crash models, live and offline; see the README."""

import os

# OpenBLAS reads it when numpy is first imported. The matrices here are small: more threads only wait for each other,
# a diagnosis then takes twice as long on an idle machine and ten times on a busy one.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
