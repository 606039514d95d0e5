"""The command `multiradar`, also as `python -m multiradar`."""

from multiradar.cli.terminal.stopping import end_on_signals


def main() -> None:
    """Run the command given by the arguments of the process and exit with its status."""
    # Ctrl-C while the command is imported, which takes half a second, must be no traceback.
    end_on_signals()
    from multiradar.cli.main import main as run_command

    run_command()


if __name__ == "__main__":
    main()
