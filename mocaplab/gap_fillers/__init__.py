"""Ways to fill gaps, a module for each, with the deviation of what they fill in."""
