"""One module per verb: its arguments and its action."""
