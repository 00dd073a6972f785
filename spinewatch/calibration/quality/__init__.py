"""Accuracy of a calibrated rig."""
