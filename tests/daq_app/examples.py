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
    head = f'name = "{name}"\ntitle = "{title}"\nlabel_seed = 1\ncontact_angle = 45.0\n'
    away = _block("stickiness", "proximal to distal", 2.0, sticky, "Push your finger once away from you.", "sticky")
    back = _block("slipperiness", "distal to proximal", 1.5, slippery, "Pull your finger once towards you.", "slippery")
    return head + away + back


def _block(name, direction, depth, indices, instruction, most):
    return f"""
[[blocks]]
name = "{name}"
descriptor = "{name}"
direction = "{direction}"
indentation = {depth}
indices = {indices}
instruction = "{instruction}"
scale_ends = ["not {most} at all", "as {most} as can be"]
"""
