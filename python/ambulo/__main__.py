"""`python -m ambulo` is `ambulo`."""

from ambulo.cli import main

if __name__ == "__main__":
    main()
