"""Implementation of the overlay's ``gym`` package: gym 0.21's names and API on top of Gymnasium."""
