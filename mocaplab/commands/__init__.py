"""The commands of the command line, a module for each: its options, its help, what it does.

torch is imported only when a command needs it, so that all others answer at once.
"""
