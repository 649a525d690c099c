"""Laws of the core: weights, chance, batches, passes, their cost and their complaints, and the toys."""
