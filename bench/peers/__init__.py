"""Other ways to calibrate, written compactly for comparison; not part of the product."""
