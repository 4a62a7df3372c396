"""The recorder: a process of its own that holds the transducer and writes the session, whatever becomes of a window."""
