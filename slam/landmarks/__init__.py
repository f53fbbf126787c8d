"""What is recognised in pictures: people, markers and the map that these make."""
