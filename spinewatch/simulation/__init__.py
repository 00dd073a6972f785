"""Simulated rigs, spines, features and images with known truth, for tests, planning, benchmarks and training."""
