"""fireworld as it is installed: what a wheel holds, what names it takes, what importing it costs."""
