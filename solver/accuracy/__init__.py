"""Error estimates, and the meshes that a tolerance requires."""
