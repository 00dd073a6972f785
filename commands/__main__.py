"""``python -m commands``: the ``spinewatch`` command where its script is not on the path."""

from commands.main import app

app()
