"""The subject's page on a tablet: its server, and its messages."""
