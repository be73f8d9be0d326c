"""python -m tractive export DIR [--parquet FILE] [--mcap FILE]"""

import argparse
import sys

from . import export, load


def main() -> int:
    """The command line. Exit code 2 for bad input."""
    parser = argparse.ArgumentParser(prog="python -m tractive")
    commands = parser.add_subparsers(required=True)
    exports = commands.add_parser("export", help="a run's trace as Parquet or MCAP")
    exports.add_argument("folder", help="the run's folder")
    exports.add_argument("--parquet", metavar="FILE")
    exports.add_argument("--mcap", metavar="FILE")
    options = parser.parse_args()
    if not (options.parquet or options.mcap):
        exports.error("one of --parquet and --mcap is needed")
    try:
        run = load(options.folder)
    except FileNotFoundError as error:
        print(error, file=sys.stderr)
        return 2
    if options.parquet:
        export.parquet(run, options.parquet)
    if options.mcap:
        export.mcap(run, options.mcap)
    return 0


if __name__ == "__main__":
    sys.exit(main())
