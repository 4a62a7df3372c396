"""The program: command line, window, recorder and batch jobs."""
