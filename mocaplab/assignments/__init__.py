"""Checks of the graded assignments, a module for each, and what they share."""
