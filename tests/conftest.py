"""Settings of all tests: one thread of linear algebra, as in production, and no time limit per example."""

from hypothesis import settings

import commands  # noqa: F401 - sets the number of threads before NumPy is imported

settings.register_profile("spinewatch", deadline=None)  # a busy machine is no failure
settings.load_profile("spinewatch")
