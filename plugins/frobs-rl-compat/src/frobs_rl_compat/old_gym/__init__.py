"""The implementation of the overlay's ``gym``: the names and the API of gym 0.21, on top of Gymnasium."""
