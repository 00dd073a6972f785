"""Exports of a surgery, one module per standard or format."""
