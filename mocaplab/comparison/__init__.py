"""Comparing methods: jobs, the processes that run them, tables and intervals."""
