"""A planned scene carried out: states of the gel, pictures, and the record of both."""
