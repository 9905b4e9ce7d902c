"""What a check leaves behind: a page for people, JSON and JUnit XML for programs, images."""
