"""Reports to read and print, one module and one template per report."""
