"""`python -m multiradar` is the command `multiradar`."""

from multiradar.cli.main import main

if __name__ == "__main__":
    main()
