"""What a session will do: protocols, orders, study design and blinding."""
