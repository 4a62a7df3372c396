"""The session's store: live file, sealed copy, readers."""
