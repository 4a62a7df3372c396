"""Scores and predictions over subjects: means, mixed models, pooling."""
