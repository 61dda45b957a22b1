"""Checks of the exercises in the notebooks, a module for each: an answer at once, with a hint."""
