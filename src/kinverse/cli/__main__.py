"""``python -m kinverse.cli``, for where the ``kinverse`` script is not on the path."""

import sys

from kinverse.cli import main

sys.exit(main())
