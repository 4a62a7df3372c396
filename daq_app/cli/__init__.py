"""The command line: verbs, options, and what they say to people and scripts."""
