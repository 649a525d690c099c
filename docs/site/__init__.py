"""The documentation site: `make docs` writes pages, an index of the code and the code itself into out-docs/.

Pages are staged as plain text first (`stage`), from the Markdown of the checkout, the docstrings, the ledger, kept runs
and the evidence; Sphinx then lays them out.  Nothing is fetched, at build time or by a reader's browser.
"""
