"""The command line: verbs, options, and their output for people and scripts."""
