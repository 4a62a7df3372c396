"""The options that say how trials are predicted, as the verbs share them."""

import argparse


def add_kinematics(parser: argparse.ArgumentParser, meaning: str) -> None:
    """Declare --kinematics."""
    parser.add_argument("--kinematics", choices=["small", "finite"], default="small", help=meaning)


def add_tau(parser: argparse.ArgumentParser, meaning: str) -> None:
    """Declare --tau."""
    parser.add_argument("--tau", choices=["computed", "as-printed"], default="computed", help=meaning)


def add_paths(parser: argparse.ArgumentParser, meaning: str, otherwise: str | None) -> None:
    """Declare --paths, which is `otherwise` where it is not given."""
    choices = ["small", "finite"]
    parser.add_argument(
        "--paths", nargs="?", const="small", choices=choices, default=otherwise, metavar="finite", help=meaning
    )
