"""The answer: settled response of a scene, its derivatives, steppers and fields."""
