"""The measuring library: arrays in, results out."""
