"""The actor that only one front of a cluster can have; its process loads no kernels."""


class Front:
    """What the actor of a front knows: its host and process.

    Parameters
    ----------
    owner : str
        Shown to another front.
    """

    def __init__(self, owner: str) -> None:
        self._owner = owner

    def owner(self) -> str:
        """Return the host and process of the front."""
        return self._owner
