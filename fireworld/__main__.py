"""The command line, as `fireworld` and as `python -m fireworld`."""

import os


def main() -> None:
    """Run the command line; a Ctrl-C that comes before it is there ends in 130, too."""
    try:
        from fireworld.cli import main as run
    except KeyboardInterrupt:
        os.write(2, b"interrupted\n")
        os._exit(130)
    run()


if __name__ == "__main__":
    main()
