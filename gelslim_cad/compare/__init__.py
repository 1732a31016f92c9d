"""What changes between two specs: fields, dimensions, rules, parts, bundle."""
