"""What several figures share: exact loops on the line, renderings in any world and in flatland, reference images."""
