"""`python -m gelslim_cad` is `gelslim`."""

from __future__ import annotations

import sys

from gelslim_cad.cli import main

if __name__ == "__main__":
    sys.exit(main())
