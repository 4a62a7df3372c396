"""The analyst's window without Qt: its state, its texts, and its background work on a session folder."""
