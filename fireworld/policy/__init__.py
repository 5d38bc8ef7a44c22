"""Policies: who decides what each brigade does."""
