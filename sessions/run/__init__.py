"""A session as it runs: machine, states, steps, runner, live detection, resuming."""
