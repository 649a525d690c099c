"""What people read: pages in Markdown, the scripts that draw their pictures, and the site made of them."""
