"""What a calibration must be: its points, its cameras and its fit."""
