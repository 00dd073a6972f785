"""Refinement of candidates by convolutional networks: sub-pixel centres with covariance."""
