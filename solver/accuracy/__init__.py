"""How far a number may be off, and the meshes that a tolerance asks for."""
