"""The answer: the settled response of a scene, its derivatives, steppers and fields."""
