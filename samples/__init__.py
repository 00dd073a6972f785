"""The sample surgery and sample calibrations, as files."""
