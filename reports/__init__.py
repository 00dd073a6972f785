"""Reports for people, one file a report."""
