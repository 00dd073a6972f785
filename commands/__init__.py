"""The command line: one file per command; the only package that may import every other one."""

import os

# OpenBLAS reads this variable once, when NumPy is imported, so it must be set before that. The matrices here are small:
# a second BLAS thread costs more than it saves.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
