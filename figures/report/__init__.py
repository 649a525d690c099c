"""What people look at: the pictures' style, tables, and the page."""
