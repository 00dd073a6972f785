"""``python -m checks``: every check of this folder; the exit status is 1 when one fails."""

import sys

from checks import architecture, codes_page, docstrings, flags_page, limits_page, measures_page, mirror

sys.exit(
    max(
        docstrings.main(),
        mirror.main(),
        flags_page.main(()),
        limits_page.main(()),
        measures_page.main(()),
        codes_page.main(()),
        architecture.main(()),
    )
)
