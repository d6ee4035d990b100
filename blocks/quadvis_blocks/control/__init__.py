"""The paper's control laws (17)-(23), and what links them to rotors and setpoints."""
