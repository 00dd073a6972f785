"""Triads (MATCH-POINT's top level): from points to labelled poses with covariances."""
