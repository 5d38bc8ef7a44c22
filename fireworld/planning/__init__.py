"""Planning: choosing by trying out, on copies of the world, what would come of it."""
