"""What a claim is: a figure and what it declares, criteria, verdicts, and the ledger of all claims."""
