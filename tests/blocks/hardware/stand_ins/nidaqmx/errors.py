"""The errors of nidaqmx."""


class Error(Exception):
    """Base error class for module."""


class DaqError(Error):
    """Error raised by any DAQmx method."""

    def __init__(self, message: str, error_code: int, task_name: str = "") -> None:
        super().__init__(f"{message}\n\nTask Name: {task_name}\n\nStatus Code: {error_code}")
