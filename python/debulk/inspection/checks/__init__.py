"""What can make the verdict of a layup worse than those of its pockets."""
