"""Shoot and calibrate: from pictures of a control field to two calibrated cameras, with their uncertainty."""
