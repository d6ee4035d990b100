"""The paper's control laws (17)-(23), and the blocks between these laws, the rotors and the setpoints."""
