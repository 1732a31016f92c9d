"""What a finger costs and what to order: prices of the bill of materials, order files."""
