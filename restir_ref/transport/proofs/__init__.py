"""What rendering does not need: whole paths to look at, other measures, a judge of shifts, a zoo of bugs."""
