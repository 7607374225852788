"""`python -m ambulo` is `ambulo`."""

import sys

if __name__ == "__main__":
    try:
        # Imports take most of the start, so Ctrl-C is most likely to land in them.
        from ambulo.cli import main

        main()
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        sys.exit(130)
