"""Official maps to cities and scenarios of fireworld, and back."""
