"""The paper in every reading: its choices, a design over them, and what comes of the claim in each."""
