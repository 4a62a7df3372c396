"""Simulated people and benches, wired into real sessions."""
