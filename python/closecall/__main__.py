"""The command ``closecall``: ``python -m closecall``."""

from ._command import main

if __name__ == "__main__":
    raise SystemExit(main())
