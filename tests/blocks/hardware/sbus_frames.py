"""Frames that others have published, with what they say."""

# The centre of all channels, by betaflight's and PX4's scale.
CENTRE = bytes.fromhex("0fe0031ff8c0073ef0810f7ce0031ff8c0073ef0810f7c0000")

# From the tests of github.com/zklapow/sbus.
SWITCHES = bytes.fromhex("0fe0031f58c00716b080052c60010bf8c0070000000000 0300".replace(" ", ""))
SWITCHES_COUNTS = [992, 992, 352, 992, 352, 352, 352, 352, 352, 352, 992, 992, 0, 0, 0, 0]

# From the tests of github.com/LapochnihIvan/SBUSParser; their flag byte has bits that no receiver sends.
MIXED = bytes(
    [15, 41, 107, 214, 235, 44, 169, 3, 33, 187, 239, 95, 95, 76, 252, 16, 236, 190, 212, 237, 81, 6, 69]
)
MIXED_COUNTS = [809, 717, 943, 1174, 58, 1602, 1006, 767, 1119, 1929, 67, 1910, 1355, 987, 404, 552]
