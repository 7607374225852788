"""The sections of a study's page, each made from its results."""
