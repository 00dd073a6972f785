"""Calibration: from images of a control field to calibrated cameras and their uncertainty."""
