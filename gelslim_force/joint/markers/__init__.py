"""The markers near a contact: data of the forces, what drift takes off, and their misfit."""
