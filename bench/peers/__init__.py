"""Other methods of calibration, for comparison; not part of the product."""
