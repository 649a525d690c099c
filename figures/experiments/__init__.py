"""What several figures share: exact loops on the line, renderings of flatland, reference images."""
