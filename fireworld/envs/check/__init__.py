"""`python -m fireworld.envs.check`: do all forms keep what their libraries, and fireworld, promise?"""
