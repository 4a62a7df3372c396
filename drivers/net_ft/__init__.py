"""The networked force/torque box."""
