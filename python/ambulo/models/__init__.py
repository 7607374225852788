"""Architectures, one file each: pure JAX, and nothing of ours."""
