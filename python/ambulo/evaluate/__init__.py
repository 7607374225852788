"""Measuring what controllers and models do."""
