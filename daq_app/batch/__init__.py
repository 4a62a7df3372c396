"""Batch computation: worker processes, a cluster, derived numbers, sensitivity."""
