"""What a run costs, in time and memory, said before it and held against the truth after it."""
