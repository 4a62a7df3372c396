"""The transducer with its own converter on an RS-485 line."""
