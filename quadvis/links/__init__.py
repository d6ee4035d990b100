"""Links between computers: messages, frames, carriers, and their twins in a simulation."""
