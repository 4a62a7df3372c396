"""A protocol of somebody's own, with one block of two surfaces."""

OWN = """
name = "own"
title = "Cloths"
label_seed = 1
contact_angle = 45.0
[[blocks]]
name = "softness"
descriptor = "softness"
direction = "proximal to distal"
indentation = 2.0
indices = [3, 70]
instruction = "Push your finger once away from you."
scale_ends = ["not soft at all", "as soft as can be"]
"""
