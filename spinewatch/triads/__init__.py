"""MATCH-POINT's top level: from points to labelled triad poses."""
