"""What computes figures chunk by chunk, stores them and judges them: knows claims, but no paper and no picture."""
