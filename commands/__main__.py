"""``python -m commands``: the ``spinewatch`` command, also where its script is not on the path."""

from commands.main import app

app()
