"""python -m solidsph."""

from solidsph.cli import main

if __name__ == "__main__":
    main()
