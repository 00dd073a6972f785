"""What ``make check`` verifies beside lint, types and import contracts."""
