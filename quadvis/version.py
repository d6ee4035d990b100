"""The version of quadvis: stated here, read by the build, the command line and the logs."""

__version__ = "0.1.0"
