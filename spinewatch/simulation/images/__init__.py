"""Simulated images of balls with truth: random worlds, ray tracing with one reflection, and a sensor model."""
