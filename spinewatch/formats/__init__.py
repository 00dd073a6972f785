"""Interchange formats: read with named errors, write exactly."""
