"""The stand-alone force/torque controller on a serial line."""
