"""The recorder: a separate process that holds the transducer and writes the session, independent of any window."""
