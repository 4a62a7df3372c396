"""What several tests of the verbs and the window begin from."""

SCENE = """
title = "slipperiness 100"
[friction]
mu = 0.24
tau_max = 0.00877
[loading]
indentation = 1.5
slide = "-x"
speed = 39.0
"""


def short_protocol(name, title, sticky, slippery):
    """Return a protocol of a few of the surfaces of sensotact-friction, by their indices, as a file holds it."""
    return f"""
name = "{name}"
title = "{title}"
label_seed = 1
contact_angle = 45.0

[[blocks]]
name = "stickiness"
descriptor = "stickiness"
direction = "proximal to distal"
indentation = 2.0
indices = {sticky}
instruction = "Push your finger once away from you."
scale_ends = ["not sticky at all", "as sticky as can be"]

[[blocks]]
name = "slipperiness"
descriptor = "slipperiness"
direction = "distal to proximal"
indentation = 1.5
indices = {slippery}
instruction = "Pull your finger once towards you."
scale_ends = ["not slippery at all", "as slippery as can be"]
"""
