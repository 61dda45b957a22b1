"""Paper B in parts: noise of two cheap recordings, their fusion, and prediction."""
