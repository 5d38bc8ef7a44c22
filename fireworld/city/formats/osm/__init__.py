"""OpenStreetMap extracts: what is read of them, and the plan of a city that is made of it."""
