"""The HTTP API: routes, schemas and problems; it stores uploads and shows results, and never measures."""
