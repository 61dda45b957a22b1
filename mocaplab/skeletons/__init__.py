"""What two skeletons have in common: names, left and right, rest poses, lengths, motions."""
