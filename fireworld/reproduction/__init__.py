"""The paper: its tables, its readings, its report."""
