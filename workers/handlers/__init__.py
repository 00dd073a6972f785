"""Handlers of jobs, one file per kind; the function ``handler`` of each module makes its handler from the settings."""
