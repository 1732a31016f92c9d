"""From displacements to the force field, the wrench and its covariance."""
