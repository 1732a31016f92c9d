"""What the accuracy page is made of: records of ladders, tables, figures, sentences."""
