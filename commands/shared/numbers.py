"""Limits that number options of several commands share."""

MAX_SEED = 2**31 - 1
"""Largest seed of random numbers, as in the API."""
