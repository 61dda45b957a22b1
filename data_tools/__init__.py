"""Scripts that prepare the data and the models that come with mocaplab."""
