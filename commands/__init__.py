"""The command line: one file a command; the only room that may import every other."""

import os

# The matrices here are small: a second thread of the linear algebra library costs more than it brings, and the
# library reads this once, when NumPy is first imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
