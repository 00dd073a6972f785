"""``python -m checks``: every check of this folder; the exit status is 1 when one fails."""

import sys

from checks import architecture, docstrings, flags_page, mirror

sys.exit(max(docstrings.main(), mirror.main(), flags_page.main(()), architecture.main(())))
