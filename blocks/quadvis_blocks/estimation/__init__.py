"""From measurements to the quantities that the control laws need."""
