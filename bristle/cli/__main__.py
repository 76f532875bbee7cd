"""`python -m bristle.cli`."""

import sys

from . import main

sys.exit(main())
