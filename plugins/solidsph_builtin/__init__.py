"""Every built-in part of solidsph, registered through the same entry points as anyone's."""
