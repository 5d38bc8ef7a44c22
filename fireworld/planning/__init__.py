"""Planning: policies that choose by simulating on copies of the world."""
