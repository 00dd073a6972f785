"""Benchmarks that print tables."""

import commands  # noqa: F401 - settles the threads of linear algebra before NumPy is imported, as in production
