"""The HTTP API: it stores uploads, submits jobs and shows results, and never measures."""
