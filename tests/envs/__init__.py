"""Environments for learners: worlds in batches, and the forms that libraries take."""
